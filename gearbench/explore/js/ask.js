// Ask the server for a gear: as it is stored after a pick, with what the sliders say after one of them moved.
const picked = cb_obj === pick;
// sliders that follow an answer, or still stand for the gear before, ask nothing
if (!picked && (answer.setting || answer.awaited)) return;
if (picked) answer.awaited = true;
const settings = picked ? null : Object.fromEntries(sliders.map((slider) => [slider.name, slider.value]));
question.data = { design: [pick.data.design[0]], settings: [settings] };
