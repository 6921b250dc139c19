// What `viewer.js` uses of three.js; bundled into three.min.js as README.md tells.
export {
  AmbientLight, BufferAttribute, BufferGeometry, DataTexture, DirectionalLight, DoubleSide,
  Group, LinearFilter, LineBasicMaterial, LineSegments, Mesh, MeshLambertMaterial,
  OrthographicCamera, Quaternion, Scene, SRGBColorSpace, Vector3, WebGLRenderer,
} from "three";
export { OrbitControls } from "three/addons/controls/OrbitControls.js";
