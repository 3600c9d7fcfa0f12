import { useFrame, useThree } from "@react-three/fiber";
import { connect, type Room } from "hairnet-client";
import { HairScene } from "hairnet-client/scene";
import { useEffect, useState } from "react";
import type { PerspectiveCamera } from "three";

export interface HairnetProps {
  /** "ws://localhost:7420" */
  server: string;
  /** "lobby" unless given */
  room?: string;
  token?: string;
  /** puts the camera in front of the characters */
  frame?: boolean;
  /** called with the room once it is joined: add your own characters there */
  onRoom?: (room: Room) => void;
  onError?: (error: Error) => void;
}

/** Everyone's hair in a room of a Hairnet server, as a child of a <Canvas>. */
export function Hairnet({ server, room = "", token = "", frame = false, onRoom, onError }: HairnetProps) {
  const renderer = useThree(({ gl }) => gl);
  const camera = useThree((state) => state.camera);
  const [hair, setHair] = useState<HairScene | null>(null);

  // A new callback is no reason to join again.
  useEffect(() => {
    let isMounted = true;
    let joined: Room | null = null;
    let made: HairScene | null = null;
    connect(server, { room, token }).then(
      (arrived) => {
        if (!isMounted) return arrived.close();
        joined = arrived;
        made = new HairScene(arrived, renderer);
        if (frame) void made.frame(camera as PerspectiveCamera);
        setHair(made);
        onRoom?.(arrived);
      },
      (error: Error) => {
        if (isMounted) onError?.(error);
      },
    );
    return () => {
      isMounted = false;
      setHair(null);
      made?.dispose();
      joined?.close();
    };
  }, [server, room, token, frame, renderer, camera]);

  useFrame((state) => hair?.update(state.camera));
  return hair && <primitive object={hair} />;
}
