// Lets one move, turn and press the handles of interactive markers, unless a tool is taken.
import { THREE } from "nicegui-scene";

const MENU = 1, BUTTON = 2, MOVE_AXIS = 3, MOVE_PLANE = 4, ROTATE_AXIS = 5, MOVE_ROTATE = 6;
const MOVE_3D = 7, ROTATE_3D = 8, MOVE_ROTATE_3D = 9;
const PERIOD = 50; // milliseconds between reports
const CLICK = 4; // pixels

function vector(list) {
  return new THREE.Vector3(...list);
}

export default class Handles {
  create_mesh(view) {
    this.mesh = new THREE.Group();
    this.ray = new THREE.Raycaster();
    this.mesh.addEventListener("added", () => this.begin(getElement(view)));
    return this.mesh;
  }

  begin(view) {
    this.view = view;
    this.canvas = view.renderer.domElement;
    const around = this.canvas.parentElement;
    // Before the controls of the camera, which listen at the canvas.
    around.addEventListener("pointerdown", (event) => this.down(event), true);
    window.addEventListener("pointermove", (event) => this.move(event), true);
    window.addEventListener("pointerup", (event) => this.up(event), true);
  }

  aim(event) {
    const box = this.canvas.getBoundingClientRect();
    const x = ((event.clientX - box.left) / box.width) * 2 - 1;
    const y = -((event.clientY - box.top) / box.height) * 2 + 1;
    this.ray.setFromCamera(new THREE.Vector2(x, y), this.view.camera);
    return this.ray.ray.clone();
  }

  // What has a handle under the pointer: the nearest.
  find(event) {
    if (event.target.handle) return { handle: event.target.handle, point: null };
    if (event.target !== this.canvas) return null;
    const things = [];
    this.mesh.parent.traverse((one) => one.handle && !one.element && things.push(one));
    if (!things.length) return null;
    this.aim(event);
    const hit = this.ray.intersectObjects(things, true)[0];
    if (!hit) return null;
    let object = hit.object;
    while (!object.handle) object = object.parent;
    return { handle: object.handle, point: hit.point };
  }

  down(event) {
    if (this.canvas.dataset.tool || (event.button !== 0 && event.button !== 2)) return;
    const found = this.find(event);
    if (!found) return;
    event.stopPropagation();
    event.preventDefault();
    const { handle, point } = found;
    this.held = {
      handle,
      origin: vector(handle.position),
      rotation: new THREE.Quaternion(...handle.rotation),
      axis: this.axisOf(handle),
      ray: this.aim(event),
      x: event.clientX,
      y: event.clientY,
      point,
      right: event.button === 2,
      moved: false,
    };
    this.held.place = { position: this.held.origin.clone(), rotation: this.held.rotation.clone() };
    this.report("down");
  }

  axisOf(handle) {
    const seen = handle.mode === MOVE_3D || handle.mode === ROTATE_3D || handle.mode === MOVE_ROTATE_3D;
    if (seen || handle.facing) return this.view.camera.getWorldDirection(new THREE.Vector3()).negate();
    return vector(handle.axis).normalize();
  }

  move(event) {
    const held = this.held;
    if (!held) {
      if (event.buttons === 0 && !this.canvas.dataset.tool) this.hover(event);
      return;
    }
    event.stopPropagation();
    if (held.right) return;
    held.moved ||= Math.hypot(event.clientX - held.x, event.clientY - held.y) > CLICK;
    if (!held.moved) return;
    const place = this.placeOf(held, event);
    if (!place) return;
    held.place = place;
    if (!this.waiting) {
      this.waiting = setTimeout(() => {
        this.waiting = null;
        if (this.held === held) this.report("move");
      }, PERIOD);
    }
  }

  hover(event) {
    const now = performance.now();
    if (now - (this.hovered ?? 0) < PERIOD) return;
    this.hovered = now;
    if (event.target === this.canvas || event.target.handle) {
      this.canvas.style.cursor = this.find(event) ? "grab" : "";
    }
  }

  placeOf(held, event) {
    const { handle, origin, rotation, axis } = held;
    const ray = this.aim(event);
    const plane = new THREE.Plane().setFromNormalAndCoplanarPoint(axis, origin);
    const on = (one) => one.intersectPlane(plane, new THREE.Vector3());
    const turned = handle.mode === MOVE_ROTATE_3D ? event.shiftKey : handle.mode === ROTATE_3D;
    if (turned) return { position: origin.clone(), rotation: this.rolled(held, event).multiply(rotation) };
    if (handle.mode === MOVE_AXIS) {
      const [from, to] = [along(held.ray, origin, axis), along(ray, origin, axis)];
      if (from === null || to === null) return null;
      return { position: origin.clone().addScaledVector(axis, to - from), rotation };
    }
    const [from, to] = [on(held.ray), on(ray)];
    if (!from || !to || handle.mode <= BUTTON) return null;
    if ([MOVE_PLANE, MOVE_3D, MOVE_ROTATE_3D].includes(handle.mode)) {
      return { position: origin.clone().add(to).sub(from), rotation };
    }
    const [first, second] = [from.clone().sub(origin), to.clone().sub(origin)];
    const angle = Math.atan2(axis.dot(first.clone().cross(second)), first.dot(second));
    const turn = new THREE.Quaternion().setFromAxisAngle(axis, angle);
    const position = origin.clone();
    if (handle.mode === MOVE_ROTATE) position.copy(to).sub(first.clone().applyQuaternion(turn));
    return { position, rotation: turn.multiply(rotation) };
  }

  // The rotation of a ball that the pointer rolls: 100 pixels are a radian.
  rolled(held, event) {
    const [right, up] = [new THREE.Vector3(), new THREE.Vector3()];
    this.view.camera.matrixWorld.extractBasis(right, up, new THREE.Vector3());
    const aside = new THREE.Quaternion().setFromAxisAngle(up, (event.clientX - held.x) / 100);
    const over = new THREE.Quaternion().setFromAxisAngle(right, (event.clientY - held.y) / 100);
    return aside.multiply(over);
  }

  up(event) {
    const held = this.held;
    if (!held) return;
    clearTimeout(this.waiting);
    this.waiting = null;
    if (held.moved) this.report("move");
    this.report("up");
    const { mode, menu } = held.handle;
    if (!held.moved && menu && (held.right || mode === MENU)) this.report("menu");
    else if (!held.moved && !held.right && mode === BUTTON) this.report("click");
    this.held = null;
    event.stopPropagation();
  }

  report(event) {
    const { handle, place, point } = this.held;
    emitEvent("rosz-handled", {
      display: handle.display,
      marker: handle.marker,
      control: handle.control,
      event,
      position: place.position.toArray(),
      rotation: place.rotation.toArray(),
      point: point ? point.toArray() : null,
    });
  }
}

// How far along a line the point is that is nearest to a ray; null if they are parallel.
function along(ray, origin, axis) {
  const between = origin.clone().sub(ray.origin);
  const cosine = axis.dot(ray.direction);
  const apart = 1 - cosine * cosine;
  if (apart < 1e-6) return null;
  return (cosine * ray.direction.dot(between) - axis.dot(between)) / apart;
}
