import { isDeepStrictEqual } from "node:util";
import { spawn } from "node:child_process";
import { existsSync, readFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { afterAll, afterEach, beforeAll, describe, expect, it } from "vitest";
import WebSocket from "ws";
import { connect, rigidPose, type Appearance, type Member, type OwnCharacter, type Room } from "../../src/index";
import type { WebSocketLike } from "../../src/index";
import { Server, findServer } from "../support/server";
import { until } from "../support/until";
import { vectorFolder } from "../support/vectors";

const kRed: Appearance = { hairRoot: 0x9e5930, hairTip: 0xb07040, skin: 0xe0c0b0, roughness: 77 / 255 };
const kGreen: Appearance = { hairRoot: 0x008000, hairTip: 0x00ff00, skin: 0x010203, roughness: 1 };

/** A person in the room with one character, as a page is. */
class Person {
  socket: WebSocket | null = null;
  room!: Room;
  own: OwnCharacter | null = null;
  readonly #turns = setInterval(() => this.#turn(), 10);

  async join(port: number, clientName: string): Promise<void> {
    this.room = await connect(`127.0.0.1:${port}`, {
      room: "who",
      clientName,
      makeSocket: (url) => {
        this.socket = new WebSocket(url, "hairnet");
        return this.socket as unknown as WebSocketLike;
      },
    });
  }
  stop(): void {
    clearInterval(this.#turns);
    this.room?.close();
  }
  /** Everyone in the room as this person knows them, the same for all people. */
  get knows(): unknown[] {
    const of = ({ session, ownerCharacter, member, tagText, appearance }: Member) =>
      ({ session, ownerCharacter, member, tagText, appearance }) as const;
    return [...this.room.members.values()].map(of).sort((a, b) => a.member - b.member);
  }
  named(name: string): Member | undefined {
    return [...this.room.members.values()].find((member) => member.tagText === name);
  }
  #turn(): void {
    this.room?.sample(0);
    this.own?.push(rigidPose([0, 0, 0, 1], [0, 1.6, 0]));
  }
}

/** hairnet-view, which streams a character of that name to the room and prints whom it has met. */
function startViewer(path: string, port: number, name: string): Promise<string> {
  const character = `groom=made:bob,motion=made:nod,level=low,name=${name},colour=#123456`;
  const flags = ["--connect", `127.0.0.1:${port}`, "--room", "who", "--no-draw", "--observe", "all"];
  const started = spawn(path, [...flags, "--character", character, "--duration", "4"]);
  let said = "";
  started.stdout.on("data", (text: Buffer) => (said += text.toString()));
  return new Promise((done) => started.on("exit", () => done(said)));
}

const program = findServer();
const viewer = program && join(dirname(program), "hairnet-view");
describe.skipIf(program === null)("with a server", () => {
  const server = new Server(program!, ["--wind", "1", "0", "2"]);
  const file = readFileSync(join(vectorFolder, "bob.groom"));
  const people: Person[] = [];
  const join_ = async (name: string): Promise<Person> => {
    const person = new Person();
    people.push(person);
    await person.join(server.port, name);
    return person;
  };
  const agree = async (what: string, all: Person[], count: number) => {
    await until(what, () => all.every((each) => isDeepStrictEqual(each.knows, all[0].knows)));
    expect(all[0].knows).toHaveLength(count);
  };

  beforeAll(() => server.start());
  afterEach(() => {
    for (const person of people.splice(0)) person.stop();
  });
  afterAll(() => server.dispose());

  it("people agree on colours, names, tags and wind, through changes, a broken line and a server's death", async () => {
    const ann = await join_("ann");
    ann.own = ann.room.addCharacter(file, { tag: "Ann", appearance: kRed });
    const ben = await join_("ben");
    ben.own = ben.room.addCharacter(file, { tag: new Uint8Array([0, 255, 7]) });
    await until("they know their members", () => ann.own!.member !== null && ben.own!.member !== null);
    await agree("everyone knows everyone", [ann, ben], 2);
    expect(ben.room.memberOf(ann.room.session, ann.own.character)).toMatchObject({ tagText: "Ann", appearance: kRed });
    expect(ann.room.memberOf(ben.room.session, ben.own.character)!.tag).toEqual(new Uint8Array([0, 255, 7]));
    expect([...ann.room.wind.meanMPerS]).toEqual([1, 0, 2]);

    ann.own.setAppearance(kGreen, "Anna");
    ben.room.setWind({ ...ann.room.wind, meanMPerS: [0, 0, -3] });
    await until("the change is seen", () => ben.named("Anna") !== undefined);
    expect(ben.named("Anna")!.appearance).toEqual(kGreen);
    await until("the wind is known", () => ann.room.wind.meanMPerS[2] === -3);
    const late = await join_("late");
    await agree("the late joiner knows the newest", [ann, ben, late], 2);
    expect(late.named("Anna")!.appearance).toEqual(kGreen);
    expect([...late.room.wind.meanMPerS]).toEqual([0, 0, -3]);

    // A change while Ben's connection is broken.
    ben.socket!.terminate();
    ann.own.setAppearance({ skin: 0x0a0b0c }, "Annabel");
    await until("Ben is back and knows", () => ben.named("Annabel") !== undefined);
    await agree("all agree again", [ann, ben, late], 2);
    expect(ben.room.counters).toMatchObject({ resumes: 1 });

    await server.kill();
    await until("all notice", () => [ann, ben, late].every(({ room }) => room.state === "reconnecting"));
    await server.start();
    const isNew = ({ room }: Person) => room.state === "connected" && room.members.size === 2;
    await until(
      "a new server tells the newest",
      () => [ann, ben, late].every(isNew) && late.named("Annabel") !== undefined,
    );
    await agree("all agree on a new server", [ann, ben, late], 2);
    expect(late.named("Annabel")!.appearance.skin).toBe(0x0a0b0c);
    expect(ann.own.member).toBe(ann.named("Annabel"));
  });

  it.skipIf(viewer === null || !existsSync(viewer))("a person and a native viewer agree", async () => {
    const ann = await join_("ann");
    ann.own = ann.room.addCharacter(file, { tag: "Ann", appearance: kRed });
    const ben = await join_("ben");
    ben.own = ben.room.addCharacter(file);
    const viewed = startViewer(viewer!, server.port, "Zo\u00eb");
    await until("the viewer's character is there", () => ann.named("Zo\u00eb") !== undefined);
    await agree("everyone knows everyone", [ann, ben], 3);
    expect(ann.named("Zo\u00eb")!.appearance.hairRoot).toBe(0x123456);
    ann.own.setAppearance(kGreen, "Anna");
    // The viewer leaves and prints whom it has met.
    const said = await viewed;
    const green = "hair #008000 to #00ff00, skin #010203, roughness 1.00";
    expect(said).toContain(`'Anna', character 1 of session ${ann.room.session}, ${green}\n`);
    expect(said).toContain(`'', character 1 of session ${ben.room.session}\n`);
    await until("the viewer has left", () => ann.named("Zo\u00eb") === undefined);
  });
});
