// Fit the pressure map to a new gear. The colours end at `top`, the 99 % quantile: a contact line that just enters at a
// corner is short and heavily loaded, and would make the rest of the flank look unloaded.
const { y: [first], dw: [width], dh: [height], top: [high] } = source.data;
mapper.setv({ high }, { sync: false });
plot.x_range.setv({ end: width }, { sync: false });
plot.y_range.setv({ start: first, end: first + height }, { sync: false });
