import { useFrame, useThree } from "@react-three/fiber";
import { connect, type Room } from "hairnet-client";
import { HairScene } from "hairnet-client/scene";
import { useEffect, useRef, useState } from "react";
import type { PerspectiveCamera } from "three";

export interface HairnetProps {
  /** The address of the server, such as "ws://localhost:7420". */
  server: string;
  /** The name of the room; by default it is the lobby. */
  room?: string;
  token?: string;
  /** Puts the camera in front of the characters. */
  frame?: boolean;
  /** Called with the room once it is joined, to add your own characters there, and with null once it is left. */
  onRoom?: (room: Room | null) => void;
  /** Called when the room cannot be joined. Without this function the error is thrown. */
  onError?: (error: Error) => void;
}

/** Everyone's hair in a room of a Hairnet server, as a child of a <Canvas>. */
export function Hairnet({ server, room = "", token = "", frame = false, onRoom, onError }: HairnetProps) {
  const renderer = useThree(({ gl }) => gl);
  const camera = useThree((state) => state.camera);
  const [hair, setHair] = useState<HairScene | null>(null);

  // New callbacks are no reason to join again.
  const callbacks = useRef({ onRoom, onError });
  useEffect(() => {
    callbacks.current = { onRoom, onError };
  });

  useEffect(() => {
    let isMounted = true;
    let leave = () => {};
    const join = async () => {
      const joined = await connect(server, { room, token });
      if (!isMounted) return joined.close();
      const made = new HairScene(joined, renderer);
      leave = () => {
        setHair(null);
        made.dispose();
        joined.close();
        callbacks.current.onRoom?.(null);
      };
      setHair(made);
      callbacks.current.onRoom?.(joined);
    };
    join().catch((error: Error) => {
      if (!isMounted) return;
      if (!callbacks.current.onError) throw error;
      callbacks.current.onError(error);
    });
    return () => {
      isMounted = false;
      leave();
    };
  }, [server, room, token, renderer]);

  useEffect(() => {
    if (frame) hair?.frame(camera as PerspectiveCamera);
  }, [hair, frame, camera]);

  useFrame((state) => hair?.update(state.camera));
  return hair && <primitive object={hair} />;
}
