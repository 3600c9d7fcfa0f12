import { FreeCamera } from "@babylonjs/core/Cameras/freeCamera";
import { Engine } from "@babylonjs/core/Engines/engine";
import { HemisphericLight } from "@babylonjs/core/Lights/hemisphericLight";
import { Color3, Color4 } from "@babylonjs/core/Maths/math.color";
import { Vector3 } from "@babylonjs/core/Maths/math.vector";
import { Scene } from "@babylonjs/core/scene";
import { connect, rigidPose } from "hairnet-client";
import { MemberHair } from "./MemberHair";

const canvas = document.querySelector("canvas") as HTMLCanvasElement;
const engine = new Engine(canvas, true);
addEventListener("resize", () => engine.resize());
const scene = new Scene(engine);
// Hairnet is right-handed, too: +Y is up, and +Z is out of the face.
scene.useRightHandedSystem = true;
scene.clearColor = new Color4(0.54, 0.56, 0.6, 1);
const light = new HemisphericLight("light", new Vector3(0.3, 1, 0.6), scene);
light.groundColor = new Color3(0.3, 0.3, 0.35);
const camera = new FreeCamera("camera", new Vector3(0, -0.05, 1.25), scene);
camera.setTarget(new Vector3(0, -0.08, 0));
camera.minZ = 0.05;
camera.fov = 0.6;

const room = await connect("ws://localhost:7420", { room: "babylon" });
const me = room.addCharacter(await (await fetch("/long_curly.groom")).arrayBuffer());

const drawn = new Map<number, MemberHair>();
room.on("left", ({ member }) => {
  drawn.get(member.member)?.dispose();
  drawn.delete(member.member);
});

engine.runRenderLoop(() => {
  // Your head turns by 0.6 rad to both sides. A program of yours has tracking or an animation here.
  const turn = 0.3 * Math.sin(performance.now() / 300);
  me.push(rigidPose([0, Math.sin(turn), 0, Math.cos(turn)]));
  for (const member of room.sample(performance.now())) {
    // The groom of a member arrives some time after the member.
    if (member.groom && !drawn.has(member.member)) drawn.set(member.member, new MemberHair(member.groom, scene));
    drawn.get(member.member)?.update(member);
  }
  scene.render();
});
