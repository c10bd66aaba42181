// Open all filters and clear the marks.
designs.explore.area = undefined;
designs.explore.marks += 1;
for (const slider of sliders) slider.value = [slider.start, slider.end];
refresh.execute(cb_obj);
