import { connect, rigidPose } from "hairnet-client";
import { HairScene } from "hairnet-client/scene";
import { PerspectiveCamera, Scene, WebGLRenderer } from "three";

const renderer = new WebGLRenderer({ antialias: true, alpha: true });
renderer.setSize(innerWidth, innerHeight);
document.body.append(renderer.domElement);
const camera = new PerspectiveCamera(35, innerWidth / innerHeight, 0.1, 100);

const room = await connect("ws://localhost:7420"); // the room "lobby"
const hair = new HairScene(room, renderer); // everyone in the room
const scene = new Scene().add(hair);
hair.frame(camera); // puts the camera in front of them
const me = room.addCharacter(await (await fetch("/long_curly.groom")).arrayBuffer());
renderer.setAnimationLoop((now) => {
  const turn = 0.3 * Math.sin(now / 300); // your head: tracking, or an animation
  me.push(rigidPose([0, Math.sin(turn), 0, Math.cos(turn)]));
  hair.update(camera);
  renderer.render(scene, camera);
});
