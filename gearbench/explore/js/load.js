// A line that just enters at a corner is short and heavily loaded: it must not hide the rest.
mapper.high = source.data.top[0];
