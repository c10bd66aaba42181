// Turn both gears to the mesh phase: the pinion clockwise by τ p_bt/r_b1, the wheel the other way.
// motion, from gear_data.py: base radii pinion_base and wheel_base, base pitch, centre distance [mm], angle α_wt [rad],
// first: u of the tooth pair 0 at τ = 0, start and end: u_A and u_E [mm], middle and half of the figure's height [mm]
const m = Object.fromEntries(Object.entries(motion.data).map(([key, column]) => [key, column[0]]));
const tau = phase.value;

// an outline turned clockwise by an angle [rad] about its centre, and moved up
function turned({ x, y }, angle, rise) {
  const sin = Math.sin(angle), cos = Math.cos(angle), result = { x: [], y: [] };
  for (let i = 0; i < x.length; i++) {
    result.x.push(x[i] * cos + y[i] * sin);
    result.y.push(y[i] * cos - x[i] * sin + rise);
  }
  return result;
}

const angles = [tau * m.pitch / m.pinion_base, -tau * m.pitch / m.wheel_base];
drawn.forEach((source, gear) => {
  source.setv({ data: turned(shapes[gear].data, angles[gear], gear * m.distance) }, { sync: false });
});
// points in contact on the line of action, see geometry/tooth_shapes.py; k numbers the tooth pairs, of which
// far fewer than 41 are ever in contact
const points = { x: [], y: [] }, sin = Math.sin(m.angle), cos = Math.cos(m.angle);
for (let k = -20; k <= 20; k++) {
  const u = m.first + (tau + k) * m.pitch;
  if (u < m.start || u > m.end) continue;
  points.x.push(-m.pinion_base * sin + u * cos);
  points.y.push(m.pinion_base * cos + u * sin);
}
contacts.setv({ data: points }, { sync: false });
const aspect = plot.inner_width / plot.inner_height || 1.5;
plot.x_range.setv({ start: -m.half * aspect, end: m.half * aspect }, { sync: false });
plot.y_range.setv({ start: m.middle - m.half, end: m.middle + m.half }, { sync: false });
