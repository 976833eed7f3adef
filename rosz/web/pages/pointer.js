// Lets one point at the ground or at what is drawn, and pull a direction, while a tool is taken.
import { THREE } from "nicegui-scene";

export default class Pointer {
  create_mesh(tool) {
    this.mesh = new THREE.Group();
    this.arrow = new THREE.ArrowHelper(new THREE.Vector3(1, 0, 0), new THREE.Vector3(), 1, 0x22aa55, 0.35, 0.22);
    this.arrow.visible = false;
    this.mesh.add(this.arrow);
    this.ray = new THREE.Raycaster();
    this.ray.params.Points.threshold = 0.05;
    this.arm(tool);
    return this.mesh;
  }

  arm(tool) {
    this.tool = tool;
    if (this.canvas) this.show();
    if (!tool || this.canvas) return;
    const scene = this.mesh.parent;
    if (!scene) {
      setTimeout(() => this.arm(this.tool), 50);
      return;
    }
    scene.onBeforeRender = (renderer, _, camera) => {
      this.camera = camera;
      if (!this.canvas) this.listen(renderer.domElement);
    };
  }

  listen(canvas) {
    this.canvas = canvas;
    const around = canvas.parentElement;
    // Before the controls of the camera, which listen at the canvas.
    around.addEventListener("pointerdown", (event) => this.down(event), true);
    around.addEventListener("pointermove", (event) => this.move(event), true);
    window.addEventListener("pointerup", (event) => this.up(event), true);
    this.show();
  }

  show() {
    this.canvas.dataset.tool = this.tool;
    this.canvas.style.cursor = this.tool ? "crosshair" : "";
  }

  aim(event) {
    const box = this.canvas.getBoundingClientRect();
    const x = ((event.clientX - box.left) / box.width) * 2 - 1;
    const y = -((event.clientY - box.top) / box.height) * 2 + 1;
    this.ray.setFromCamera(new THREE.Vector2(x, y), this.camera);
  }

  ground(event) {
    this.aim(event);
    return this.ray.ray.intersectPlane(new THREE.Plane(new THREE.Vector3(0, 0, 1), 0), new THREE.Vector3());
  }

  thing(event) {
    const ground = this.ground(event);
    const hits = this.ray.intersectObjects(this.mesh.parent.children, true);
    return hits.find((hit) => !hit.object.isLine)?.point ?? ground;
  }

  down(event) {
    if (!this.tool || event.button !== 0) return;
    this.begin = this.tool === "point" ? this.thing(event) : this.ground(event);
    this.yaw = 0;
    event.stopPropagation();
    event.preventDefault();
  }

  move(event) {
    if (!this.begin || this.tool === "point") return;
    const end = this.ground(event);
    if (!end || end.distanceTo(this.begin) < 0.01) return;
    const along = end.clone().sub(this.begin);
    this.yaw = Math.atan2(along.y, along.x);
    this.arrow.position.copy(this.begin);
    this.arrow.setDirection(along.normalize());
    this.arrow.visible = true;
    event.stopPropagation();
  }

  up() {
    if (!this.begin) return;
    const { x, y, z } = this.begin;
    this.begin = null;
    this.arrow.visible = false;
    emitEvent("rosz-placed", { tool: this.tool, x, y, z, yaw: this.yaw });
  }
}
