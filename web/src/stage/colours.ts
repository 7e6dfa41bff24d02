// Colours of speeds, which colour-blind eyes tell apart, too.
import { Color } from 'three';

const VIRIDIS = ['#440154', '#3b528b', '#21918c', '#5ec962', '#fde725'].map((hex) => new Color(hex));
const ON_LIGHT = ['#3b0f70', '#31688e', '#1f8a70', '#d97706', '#dc2626'].map((hex) => new Color(hex));

// The colour of a share from 0 to 1.
export function shareColour(share: number, dark: boolean): Color {
  const stops = dark ? VIRIDIS : ON_LIGHT;
  const at = Math.min(Math.max(share, 0), 1) * (stops.length - 1);
  const index = Math.min(Math.floor(at), stops.length - 2);
  return stops[index]!.clone().lerp(stops[index + 1]!, at - index);
}
