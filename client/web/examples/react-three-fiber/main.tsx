import { Canvas, useFrame } from "@react-three/fiber";
import { type OwnCharacter, type Room, rigidPose } from "hairnet-client";
import { StrictMode, useEffect, useRef, useState } from "react";
import { createRoot } from "react-dom/client";
import { Hairnet } from "./Hairnet";

/** Everyone in the room, and your own head, which shakes. */
function Scene() {
  const [room, setRoom] = useState<Room | null>(null);
  const me = useRef<OwnCharacter | null>(null);
  useEffect(() => {
    if (!room) return;
    const join = async () => {
      const file = await (await fetch("/long_curly.groom")).arrayBuffer();
      if (room.state !== "closed") me.current = room.addCharacter(file);
    };
    void join();
    // The room has been left, and the character with it.
    return () => {
      me.current = null;
    };
  }, [room]);
  useFrame(({ clock }) => {
    const turn = 0.3 * Math.sin(clock.elapsedTime / 0.3);
    me.current?.push(rigidPose([0, Math.sin(turn), 0, Math.cos(turn)]));
  });
  return (
    <Hairnet
      server="ws://localhost:7420"
      room="react"
      frame
      onRoom={setRoom}
      onError={(error) => document.body.append(error.message)}
    />
  );
}

createRoot(document.getElementById("root") as HTMLElement).render(
  <StrictMode>
    <Canvas camera={{ fov: 35, near: 0.1, far: 100 }}>
      <Scene />
    </Canvas>
  </StrictMode>,
);
