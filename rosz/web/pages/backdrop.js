// Keeps the background of the view in the color of the page, and draws it only while it changes.
import { THREE } from "nicegui-scene";

const SEEN = 200; // milliseconds in which what was told to change is drawn
const OTHERWISE = 1000; // milliseconds between drawings of what may have changed untold
const EVENTS = ["rosz-drawn", "pointermove", "pointerdown", "pointerup", "wheel", "keydown", "resize"];

export default class Backdrop {
  create_mesh(view) {
    const mesh = new THREE.Group();
    const paint = () => {
      const color = getComputedStyle(document.body).getPropertyValue("--rosz-scene").trim();
      if (mesh.parent) mesh.parent.background = new THREE.Color(color);
      this.change();
    };
    mesh.addEventListener("added", () => {
      this.drawOnChange(getElement(view).renderer);
      paint();
    });
    new MutationObserver(paint).observe(document.body, { attributes: true, attributeFilter: ["class"] });
    return mesh;
  }

  change() {
    this.changed = performance.now();
  }

  drawOnChange(renderer) {
    const draw = renderer.render.bind(renderer);
    const [before, now] = [new THREE.Matrix4(), new THREE.Matrix4()];
    let drawn = 0;
    renderer.render = (scene, camera) => {
      camera.updateMatrixWorld();
      now.multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse);
      const time = performance.now();
      if (now.equals(before) && time > this.changed + SEEN && time < drawn + OTHERWISE) return;
      before.copy(now);
      drawn = time;
      draw(scene, camera);
    };
    for (const event of EVENTS) window.addEventListener(event, () => this.change(), true);
    window.socket.onAny(() => this.change());
  }
}
