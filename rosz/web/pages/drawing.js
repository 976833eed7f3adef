// Shows the drawings of one display: it fetches the newest one when it has time, and skips others.
import { THREE, CSS2DObject, STLLoader, GLTFLoader } from "nicegui-scene";

const shapes = {
  cube: new THREE.BoxGeometry(1, 1, 1),
  sphere: new THREE.SphereGeometry(0.5, 24, 16),
  cylinder: new THREE.CylinderGeometry(0.5, 0.5, 1, 24).rotateX(Math.PI / 2),
  cone: new THREE.ConeGeometry(0.5, 1, 24).rotateX(Math.PI / 2),
};
const loaders = { stl: new STLLoader(), glb: new GLTFLoader(), picture: new THREE.TextureLoader() };
const loaded = new Map();

function load(url, form) {
  const key = `${form} ${url}`;
  if (!loaded.has(key)) loaded.set(key, loaders[form].loadAsync(window.path_prefix + url));
  return loaded.get(key);
}

// The rows of a texture begin below for the shapes here, and above for those of glTF.
async function loadTexture(url, upright) {
  const texture = (await load(url, "picture")).clone();
  texture.colorSpace = THREE.SRGBColorSpace;
  texture.wrapS = texture.wrapT = THREE.RepeatWrapping;
  texture.flipY = upright;
  texture.needsUpdate = true;
  return texture;
}

function textureOf(url, upright) {
  const key = `${upright} ${url}`;
  if (!loaded.has(key)) loaded.set(key, loadTexture(url, upright));
  return loaded.get(key);
}

function drawn() {
  window.dispatchEvent(new Event("rosz-drawn")); // backdrop.js draws the view
}

function show(material, url, upright) {
  if (!url) return;
  textureOf(url, upright).then((texture) => {
    material.map = texture;
    material.needsUpdate = true;
    drawn();
  });
}

export default class Drawing {
  create_mesh(url) {
    this.mesh = new THREE.Group();
    if (url) this.update(url);
    return this.mesh;
  }

  async update(url) {
    this.wanted = url;
    if (this.busy) return;
    this.busy = true;
    try {
      while (this.wanted !== this.shown) {
        const next = this.wanted;
        const response = await fetch(window.path_prefix + next);
        if (response.status === 200) this.draw(await response.arrayBuffer());
        this.shown = next;
      }
    } catch (error) {
      if (!(error instanceof TypeError)) throw error; // the server is gone
    } finally {
      this.busy = false;
    }
  }

  draw(buffer) {
    const length = new DataView(buffer).getUint32(0, true);
    const parts = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
    let at = 4 + length;
    const take = (kind, count) => {
      const found = new kind(buffer, at, count);
      at += 4 * Math.ceil(found.byteLength / 4);
      return found;
    };
    const old = [...this.mesh.children];
    this.known = new Map(old.filter((one) => one.label).map((one) => [one.label, one]));
    const added = parts.map((part) => {
      const object = this[part.kind](part, take);
      object.handle = part.handle; // handles.js moves it
      if (object.element) object.element.handle = part.handle;
      return object;
    });
    for (const one of old) {
      if (added.includes(one)) continue;
      if (one.own) {
        one.geometry.dispose();
        one.material.map?.dispose();
      }
      one.material?.dispose();
      if (one.isInstancedMesh) one.dispose();
      this.mesh.remove(one);
    }
    for (const one of added) this.mesh.add(one);
    drawn();
  }

  geometry(part, take) {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(take(Float32Array, 3 * part.count), 3));
    geometry.setAttribute("color", new THREE.BufferAttribute(take(Uint8Array, 4 * part.count), 4, true));
    return geometry;
  }

  finish(object) {
    object.own = true;
    object.frustumCulled = false;
    return object;
  }

  points(part, take) {
    const settings = { size: part.size, sizeAttenuation: !part.pixels, vertexColors: true, transparent: part.clear };
    return this.finish(new THREE.Points(this.geometry(part, take), new THREE.PointsMaterial(settings)));
  }

  lines(part, take) {
    const settings = { vertexColors: true, transparent: part.clear };
    return this.finish(new THREE.LineSegments(this.geometry(part, take), new THREE.LineBasicMaterial(settings)));
  }

  triangles(part, take) {
    const settings = { vertexColors: true, transparent: part.clear, flatShading: true, side: THREE.DoubleSide };
    return this.finish(new THREE.Mesh(this.geometry(part, take), new THREE.MeshLambertMaterial(settings)));
  }

  shapes(part, take) {
    const clear = part.opacity < 1;
    const material = new THREE.MeshLambertMaterial({ transparent: clear, opacity: part.opacity, depthWrite: !clear });
    show(material, part.texture, true);
    const found = new THREE.InstancedMesh(shapes[part.shape], material, part.count);
    found.instanceMatrix = new THREE.InstancedBufferAttribute(take(Float32Array, 16 * part.count), 16);
    const paint = take(Uint8Array, 4 * part.count);
    const colors = new Uint8Array(3 * part.count);
    for (let i = 0; i < part.count; i++) colors.set(paint.subarray(4 * i, 4 * i + 3), 3 * i);
    found.instanceColor = new THREE.InstancedBufferAttribute(colors, 3, true);
    found.frustumCulled = false;
    return found;
  }

  text(part) {
    const name = JSON.stringify([part.text, part.color, part.height, part.handle?.control]);
    const known = this.known.get(name); // a new one would flicker
    if (known) {
      this.known.delete(name);
      known.position.set(...part.at);
      return known;
    }
    const label = document.createElement("div");
    label.textContent = part.text;
    label.className = "rosz-label";
    if (part.color) label.style.color = part.color;
    if (part.handle) label.style.pointerEvents = "auto";
    const found = new CSS2DObject(label);
    found.label = name;
    found.position.set(...part.at);
    if (part.height) {
      found.onBeforeRender = (renderer, scene, camera) => {
        const far = camera.position.distanceTo(found.getWorldPosition(new THREE.Vector3()));
        const span = camera.fov ? 2 * far * Math.tan((camera.fov * Math.PI) / 360) : camera.top - camera.bottom;
        const pixels = (part.height / span) * renderer.getSize().height;
        label.style.fontSize = `${Math.min(Math.max(pixels, 1), 400)}px`;
      };
    } else {
      found.center.set(-0.1, 1.1);
    }
    return found;
  }

  model(part) {
    const found = new THREE.Group();
    found.matrixAutoUpdate = false;
    found.matrix.fromArray(part.matrix);
    load(part.url, part.form).then((model) => {
      const object = part.form === "stl" ? new THREE.Mesh(model) : model.scene.clone();
      const color = part.color ?? (part.form === "stl" ? [200, 200, 200, 255] : null);
      object.traverse((one) => {
        if (one.isMesh) one.material = color ? this.painted(color, part.texture) : this.plain(one.material);
      });
      found.add(object);
      drawn();
    });
    return found;
  }

  painted(color, texture) {
    const material = new THREE.MeshLambertMaterial({
      color: new THREE.Color(color[0] / 255, color[1] / 255, color[2] / 255).convertSRGBToLinear(),
      opacity: color[3] / 255,
      transparent: color[3] < 255,
      side: THREE.DoubleSide,
    });
    show(material, texture, false);
    return material;
  }

  // Metal is black where there is nothing to reflect.
  plain({ color, map, opacity, transparent, alphaTest, vertexColors }) {
    const settings = { map, opacity, transparent, alphaTest, vertexColors, side: THREE.DoubleSide };
    return new THREE.MeshLambertMaterial({ ...settings, color: color ?? 0xffffff });
  }

  image(part, take) {
    const palette = new Uint32Array(take(Uint8Array, 1024).slice().buffer);
    const cells = take(Uint8Array, part.width * part.height);
    const pixels = new Uint32Array(cells.length);
    for (let i = 0; i < cells.length; i++) pixels[i] = palette[cells[i]];
    const map = new THREE.DataTexture(new Uint8Array(pixels.buffer), part.width, part.height, THREE.RGBAFormat);
    map.colorSpace = THREE.SRGBColorSpace;
    map.needsUpdate = true;
    const geometry = new THREE.PlaneGeometry(1, 1).translate(0.5, 0.5, 0);
    const settings = {
      map,
      transparent: true,
      side: THREE.DoubleSide,
      depthWrite: false,
      polygonOffset: true, // lines on the ground are above it
      polygonOffsetFactor: 1,
      polygonOffsetUnits: 4,
    };
    const found = this.finish(new THREE.Mesh(geometry, new THREE.MeshBasicMaterial(settings)));
    found.renderOrder = -1;
    found.matrixAutoUpdate = false;
    found.matrix.fromArray(part.matrix);
    return found;
  }
}
