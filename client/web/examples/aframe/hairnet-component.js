import AFRAME from "aframe";
import { connect, HairScene, rigidPose } from "hairnet-client";

const kJoinedWith = ["server", "room", "token", "groom"];

/** Everyone's hair in a room, at this entity. With `groom`, your own head too. Emits "hairnet-error" with the reason. */
AFRAME.registerComponent("hairnet", {
  schema: {
    server: { default: "ws://localhost:7420" },
    // The name of the room; empty: the lobby.
    room: { default: "" },
    token: { default: "" },
    // The address of a .groom file for your own character; empty: you only watch.
    groom: { default: "" },
    // Your own head turns to and fro.
    shake: { default: false },
  },

  // A-Frame calls it at first with no data before, then after each change.
  update(before) {
    if (kJoinedWith.every((name) => this.data[name] === before[name])) return;
    this.leave();
    this.join();
  },

  remove() {
    this.leave();
  },

  tick(time) {
    if (!this.hair) return;
    const turn = this.data.shake ? 0.3 * Math.sin(time / 300) : 0;
    this.me?.push(rigidPose([0, Math.sin(turn), 0, Math.cos(turn)]));
    this.hair.update(this.el.sceneEl.camera);
  },

  async join() {
    const { server, room, token, groom } = this.data;
    const attempt = Symbol(room);
    // A later call of `join` or `leave` replaces this mark, and what an older call has got by then is closed.
    this.attempt = attempt;
    try {
      const file = groom && (await (await fetch(groom)).arrayBuffer());
      const joined = await connect(server, { room, token });
      if (this.attempt !== attempt) return joined.close();
      this.room = joined;
      this.hair = new HairScene(joined, this.el.sceneEl.renderer);
      this.el.setObject3D("hairnet", this.hair);
      if (file) this.me = joined.addCharacter(file);
    } catch (error) {
      if (this.attempt !== attempt) return;
      this.el.emit("hairnet-error", { reason: error.message });
      throw error;
    }
  },

  leave() {
    this.attempt = null;
    if (this.hair) this.el.removeObject3D("hairnet");
    this.hair?.dispose();
    this.room?.close();
    this.hair = this.room = this.me = null;
  },
});
