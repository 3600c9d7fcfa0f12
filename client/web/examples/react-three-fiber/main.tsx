import { Canvas, useFrame } from "@react-three/fiber";
import { type OwnCharacter, type Room, rigidPose } from "hairnet-client";
import { useRef } from "react";
import { createRoot } from "react-dom/client";
import { Hairnet } from "./Hairnet";

/** Your own head, which shakes. */
function Scene() {
  const me = useRef<OwnCharacter | null>(null);
  const join = async (room: Room) => {
    const file = await fetch("/long_curly.groom");
    me.current = room.addCharacter(await file.arrayBuffer());
  };
  useFrame(({ clock }) => {
    const turn = 0.3 * Math.sin(clock.elapsedTime / 0.3);
    me.current?.push(rigidPose([0, Math.sin(turn), 0, Math.cos(turn)]));
  });
  return (
    <Hairnet
      server="ws://localhost:7420"
      room="react"
      frame
      onRoom={join}
      onError={(error) => document.body.append(error.message)}
    />
  );
}

createRoot(document.getElementById("root") as HTMLElement).render(
  <Canvas camera={{ fov: 35, near: 0.1, far: 100 }}>
    <Scene />
  </Canvas>,
);
