if (!window.roszDrives) {
  window.roszDrives = setInterval(() => emitEvent('rosz-alive'), 200);
  for (const name of ['blur', 'pagehide']) {
    window.addEventListener(name, () => emitEvent('rosz-release'));
  }
  let moved = false;
  setInterval(() => {
    const pad = navigator.getGamepads().find((one) => one !== null && one.axes.length >= 2);
    if (!pad) return;
    const stick = [pad.axes[0], pad.axes[1]].map((one) => Math.abs(one) < 0.12 ? 0 : one);
    const moves = stick.some((one) => one !== 0);
    if (moves || moved) emitEvent('rosz-gamepad', stick);
    moved = moves;
  }, 50);
}
