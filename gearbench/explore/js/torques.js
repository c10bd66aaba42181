// Let the colours of the Harris map run from the least torque to the greatest.
const { torque } = source.data;
if (torque.length) mapper.setv({ low: Math.min(...torque), high: Math.max(...torque) }, { sync: false });
