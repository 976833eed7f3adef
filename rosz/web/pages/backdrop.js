// Keeps the background of the view in the color of the page, light or dark.
import { THREE } from "nicegui-scene";

export default class Backdrop {
  create_mesh() {
    const mesh = new THREE.Group();
    const paint = () => {
      const color = getComputedStyle(document.body).getPropertyValue("--rosz-scene").trim();
      if (mesh.parent) mesh.parent.background = new THREE.Color(color);
    };
    mesh.addEventListener("added", paint);
    new MutationObserver(paint).observe(document.body, { attributes: true, attributeFilter: ["class"] });
    return mesh;
  }
}
