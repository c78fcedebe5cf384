// The bundled libraries as the page's scripts see them: globals.
import type * as Bundle from "./three.js";
import type Plot from "uplot";

declare global {
  const THREE: typeof Bundle;
  const uPlot: typeof Plot;
}
