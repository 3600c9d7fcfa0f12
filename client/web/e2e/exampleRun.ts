import { execFileSync, spawn, type ChildProcess } from "node:child_process";
import { existsSync, mkdirSync, mkdtempSync, readFileSync, rmSync, symlinkSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import { inject } from "vitest";
import { kBin, until } from "./hairnetServer";

const kRoot = resolve("../..");
const kPackage = resolve(".");
const kExamples = resolve("examples");
/** The packages of all examples, which deploy/web --examples installs. */
export const areExamplesInstalled = existsSync(join(kExamples, "node_modules/.package-lock.json"));

/** What the page of an example says: its commands, after those of the set-up, and the address to open. */
interface ExamplePage {
  readonly commands: readonly string[];
  readonly address: URL;
}

export function readPage(name: string): ExamplePage {
  const text = readFileSync(join(kExamples, name, "README.md"), "utf8");
  const [setup, ...blocks] = [...text.matchAll(/^```sh\n(.*?)^```$/gms)].map(([, block]) => block.trim().split("\n"));
  const address = /Open `(http[^`]*)`/.exec(text)?.[1];
  if (!setup?.every((command) => command.startsWith("deploy/")) || blocks.length !== 1 || !address)
    throw new Error(`${name}/README.md: no set-up, no commands, or no address`);
  return { commands: blocks[0], address: new URL(address) };
}

function run(command: string, cwd: string): void {
  execFileSync("bash", ["-c", command], { cwd });
}

/**
 * Follows the commands of an example's page, from the root of the repository. They run as they are written, except that
 * programs come from HAIRNET_BIN, that servers listen on free ports, since those of the page may be in use, and that they
 * share levels with those of other tests.
 */
export class ExampleRun {
  readonly #started: ChildProcess[] = [];
  readonly #folder = mkdtempSync(join(tmpdir(), "hairnet-example-"));

  /** Returns the address to open: that of the page, with the port that the development server got. */
  async start(page: ExamplePage, serverPort: number): Promise<URL> {
    const address = new URL(page.address);
    for (const command of page.commands) {
      const real = command.replace(/^build\/release\/bin\//, `${kBin}/`);
      if (command.includes("/hairnet-server ")) await this.#startServer(real.replace(/ *&$/, ""), serverPort);
      else if (command.includes("npx vite")) address.port = await this.#startVite(real);
      else if (command.includes(" http.server 8000 ")) address.port = await this.#startPython(real);
      else run(real, kRoot);
    }
    return address;
  }

  /**
   * Builds a project outside of the repository: the program of the package's page, and of packages only the packed one,
   * three, and vite. Returns the address of what vite has built.
   */
  async startProject(serverPort: number): Promise<URL> {
    const project = join(this.#folder, "project");
    const packages = join(project, "node_modules");
    mkdirSync(join(packages, "hairnet-client"), { recursive: true });
    mkdirSync(join(project, "public"));
    run(`npm pack --silent --ignore-scripts --pack-destination ${project}`, kPackage);
    run("tar -xzf *.tgz --strip-components 1 -C node_modules/hairnet-client", project);
    for (const name of ["three", "vite"]) symlinkSync(join(kPackage, "node_modules", name), join(packages, name));
    const [, program] = /^```ts\n(.*?)^```$/ms.exec(readFileSync("README.md", "utf8"))!;
    writeFileSync(join(project, "main.js"), program);
    writeFileSync(
      join(project, "index.html"),
      '<!doctype html><link rel="icon" href="data:,"><script type="module" src="main.js"></script>',
    );
    run(`${kBin}/hairnet-groom make long_curly --out public/long_curly.groom`, project);
    const vite = `node ${packages}/vite/bin/vite.js`;
    run(`${vite} build --logLevel error --target esnext`, project);
    await this.#startServer(`${kBin}/hairnet-server`, serverPort);
    const port = await this.#startVite(`cd ${project} && exec ${vite} preview`);
    return new URL(`http://localhost:${port}/`);
  }

  async dispose(): Promise<void> {
    for (const each of this.#started.splice(0)) {
      const hasEnded = new Promise((done) => each.once("exit", done));
      process.kill(-each.pid!, "SIGKILL"); // with the processes that it started
      await hasEnded;
    }
    rmSync(this.#folder, { recursive: true });
  }

  async #startServer(command: string, port: number): Promise<void> {
    const portFile = join(this.#folder, "port");
    const flags = `--workers 1 --webtransport off --level-cache ${inject("levelCache")} --learn-hair never`;
    this.#spawn(`exec ${command} --port ${port} --port-file ${portFile} ${flags}`);
    await until("the server listens", () => existsSync(portFile) && readFileSync(portFile, "utf8").trim() !== "");
  }

  #startVite(command: string): Promise<string> {
    return this.#portOf(this.#spawn(command), /localhost:(\d+)/);
  }

  #startPython(command: string): Promise<string> {
    return this.#portOf(
      this.#spawn(`exec ${command.replace("python3", "python3 -u").replace(" 8000 ", " 0 ")}`),
      /port (\d+)/,
    );
  }

  /** The port that a web server says it has, beside the pattern. */
  async #portOf(server: ChildProcess, pattern: RegExp): Promise<string> {
    let said = "";
    server.stdout!.on("data", (text: Buffer) => (said += text.toString()));
    const port = () => pattern.exec(said)?.[1];
    await until("the web server listens", () => port() !== undefined);
    return port()!;
  }

  #spawn(command: string): ChildProcess {
    const child = spawn("bash", ["-c", command], {
      cwd: kRoot,
      env: { ...process.env, NO_COLOR: "1" },
      detached: true,
      stdio: ["ignore", "pipe", "inherit"],
    });
    this.#started.push(child);
    return child;
  }
}
