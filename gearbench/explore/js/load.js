// A line that just enters at a corner is short and heavily loaded: it must not hide the rest.
const { y: [first], dw: [width], dh: [height], top: [high] } = source.data;
mapper.setv({ high }, { sync: false });
plot.x_range.setv({ end: width }, { sync: false });
plot.y_range.setv({ start: first, end: first + height }, { sync: false });
