import { ModuleFile, setModule } from "./module/moduleFile";
import base64 from "./module/hairnet.wasm?inline";

/** The same as hairnet-client, with the hair module inside: for where no file can be beside the package's. */
setModule(new ModuleFile(() => Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0))));

export * from "./index";
