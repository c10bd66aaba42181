// The colours of the Harris map reach from the least torque to the greatest.
const { torque } = source.data;
if (torque.length) mapper.setv({ low: Math.min(...torque), high: Math.max(...torque) }, { sync: false });
