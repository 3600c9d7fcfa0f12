import { connect, Groom } from "hairnet-client";
import { HairScene } from "hairnet-client/scene";
import { loadVrm, lowerArms, VrmHair } from "hairnet-client/vrm";
import { AmbientLight, DirectionalLight, PerspectiveCamera, Scene, Timer, WebGLRenderer } from "three";

const renderer = new WebGLRenderer({ antialias: true, alpha: true });
renderer.setSize(innerWidth, innerHeight);
document.body.append(renderer.domElement);
const camera = new PerspectiveCamera(35, innerWidth / innerHeight, 0.1, 100);

const fetched = async (address: string) => (await fetch(address)).arrayBuffer();
const vrm = await loadVrm(await fetched("/default_avatar.vrm"));
lowerArms(vrm);

const room = await connect("ws://localhost:7420", { room: "avatars" });
const hair = new HairScene(room, renderer);
const scene = new Scene().add(new AmbientLight(0xffffff, 1.5), new DirectionalLight(0xffffff, 2), vrm.scene, hair);
hair.frame(camera);

const file = await fetched("/wavy.groom");
// This hides the model's own hair.
const vrmHair = new VrmHair(vrm);
// `fit` measures the groom's head and the model's, and makes the hair as large as the model's head needs it.
vrmHair.fit(await Groom.load(file));
const me = room.addCharacter(file);
hair.addEventListener("characteradded", ({ character }) => {
  if (character.own) vrmHair.attach(character);
});

const timer = new Timer();
renderer.setAnimationLoop((now) => {
  timer.update(now);
  vrm.humanoid.getNormalizedBoneNode("head")?.rotation.set(0, 0.6 * Math.sin(now / 300), 0);
  vrm.update(timer.getDelta());
  // Everyone else gets the model's bones as the pose of your character.
  me.push(vrmHair.pose());
  hair.update(camera);
  renderer.render(scene, camera);
});
