import { type VRM, VRMLoaderPlugin } from "@pixiv/three-vrm";
import { connect, decodeGroom } from "hairnet-client";
import { HairScene } from "hairnet-client/scene";
import { VrmHair } from "hairnet-client/vrm";
import { AmbientLight, DirectionalLight, PerspectiveCamera, Scene, Timer, WebGLRenderer } from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";

const renderer = new WebGLRenderer({ antialias: true, alpha: true });
renderer.setSize(innerWidth, innerHeight);
document.body.append(renderer.domElement);
const scene = new Scene();
scene.add(new AmbientLight(0xffffff, 1.5), new DirectionalLight(0xffffff, 2));
const camera = new PerspectiveCamera(35, innerWidth / innerHeight, 0.1, 100);

const loader = new GLTFLoader();
loader.register((parser) => new VRMLoaderPlugin(parser));
const vrm: VRM = (await loader.loadAsync("/default_avatar.vrm")).userData.vrm;
vrm.scene.rotation.y = vrm.meta?.metaVersion === "0" ? Math.PI : 0; // VRM 0 models look along -Z
scene.add(vrm.scene);

const room = await connect("ws://localhost:7420", { room: "avatars" });
const hair = new HairScene(room, renderer);
scene.add(hair);
hair.frame(camera);

const file = await (await fetch("/wavy.groom")).arrayBuffer();
const worn = new VrmHair(vrm); // hides the model's own hair
worn.fit(decodeGroom(new Uint8Array(file))); // measures both heads
const me = room.addCharacter(file);
hair.addEventListener("characteradded", ({ character }) => {
  if (character.own) worn.wear(character);
});

const timer = new Timer();
renderer.setAnimationLoop((now) => {
  timer.update(now);
  vrm.humanoid.getNormalizedBoneNode("head")?.rotation.set(0, 0.6 * Math.sin(now / 300), 0);
  vrm.update(timer.getDelta());
  me.push(worn.pose());
  hair.update(camera);
  renderer.render(scene, camera);
});
