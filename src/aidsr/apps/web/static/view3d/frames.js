// Reads what aidsr/apps/web/view3d/frames.py packs; the layout is written down there.

export const FACTS = 0;
export const FRAME = 1;
export const STATE = 2;
export const TESTS = 3;
export const TRACKS = 4;

const POSE_NUMBERS = 12;
const SEGMENT_NUMBERS = 8;
const CONTACT_NUMBERS = 6;
const HEADER_BYTES = 32;

/** Return {kind, value} of a message; the value of a frame is views into its bytes. */
export function readMessage(buffer) {
  const kind = new DataView(buffer).getUint32(0, true);
  if (kind === FRAME) return { kind, value: readFrame(buffer) };
  return { kind, value: JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4))) };
}

function readFrame(buffer) {
  const header = new DataView(buffer);
  const [parts, segments, tendons, controls, contacts] = [4, 8, 12, 16, 20].map((at) => header.getUint32(at, true));
  let at = HEADER_BYTES;
  const take = (count) => {
    const numbers = new Float32Array(buffer, at, count);
    at += 4 * count;
    return numbers;
  };
  return {
    time: header.getFloat32(24, true),
    pace: header.getFloat32(28, true),
    poses: take(parts * POSE_NUMBERS),
    segments: take(segments * SEGMENT_NUMBERS),
    tensions: take(tendons),
    ctrl: take(controls),
    contacts: take(contacts * CONTACT_NUMBERS),
  };
}
