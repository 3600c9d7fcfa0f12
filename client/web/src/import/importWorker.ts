import { doInWorker } from "../module/inWorker";
import { importGroom } from "./importGroom";

doInWorker(importGroom, ({ groom }) => groom);
