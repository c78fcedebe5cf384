// The bundled libraries as the page's scripts see them: globals.
import type * as Bundle from "./three.js";
import type UPlot from "uplot";

declare global {
  const THREE: typeof Bundle;
  const uPlot: typeof UPlot;
  type Plot = UPlot;
  type Vector = Bundle.Vector3;
  type Attribute = Bundle.BufferAttribute;
}
