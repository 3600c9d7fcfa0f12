import AFRAME from "aframe";
import { connect, HairScene, rigidPose } from "hairnet-client";

/** Everyone's hair in a room, at this entity. With `groom`, your own head too. Emits "hairnet-error" with the reason. */
AFRAME.registerComponent("hairnet", {
  schema: {
    server: { default: "ws://localhost:7420" },
    room: { default: "" }, // empty: the lobby
    token: { default: "" },
    groom: { default: "" }, // a .groom file of your own character; empty: none
    shake: { default: false }, // your own head turns to and fro
  },

  async init() {
    const { server, room, token, groom } = this.data;
    try {
      const joined = await connect(server, { room, token });
      if (this.isRemoved) return joined.close();
      this.room = joined;
      this.hair = new HairScene(joined, this.el.sceneEl.renderer);
      this.el.setObject3D("hairnet", this.hair);
      if (groom) this.me = joined.addCharacter(await (await fetch(groom)).arrayBuffer());
    } catch (error) {
      this.el.emit("hairnet-error", { reason: error.message });
      throw error;
    }
  },

  tick(time) {
    if (!this.hair) return;
    const turn = this.data.shake ? 0.3 * Math.sin(time / 300) : 0;
    this.me?.push(rigidPose([0, Math.sin(turn), 0, Math.cos(turn)]));
    this.hair.update(this.el.sceneEl.camera);
  },

  remove() {
    this.isRemoved = true;
    this.el.removeObject3D("hairnet");
    this.hair?.dispose();
    this.room?.close();
  },
});
