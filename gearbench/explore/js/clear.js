for (const slider of sliders) slider.value = [slider.start, slider.end];
designs.selected.indices = [];
