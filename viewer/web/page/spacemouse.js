// A 3D mouse of 3Dconnexion by WebHID: opens it, and hands its reports to the program, which decodes them.
'use strict';

// Six axes: usage "multi-axis controller". Logitech sold the first ones.
const kSpaceMice = [{vendorId: 0x256f, usagePage: 1, usage: 8}, {vendorId: 0x046d, usagePage: 1, usage: 8}];
const kNoWebHid = 'this browser has no WebHID: for a 3D mouse use Chromium, Chrome or Edge, ' +
                  'or start filiform view --device spacemouse';

// `say(text)` shows one line. Returns the button that asks for a mouse.
function offerSpaceMouse(say) {
  const button = document.createElement('button');
  button.id = 'spacemouse';
  button.textContent = '3D mouse';
  button.title = 'Use a SpaceMouse of 3Dconnexion';
  let opened = [];  // HIDDevice: a receiver has several

  const isOurs = (device) => device.collections.some(
    (one) => kSpaceMice.some((mouse) => mouse.vendorId === device.vendorId && mouse.usagePage === one.usagePage &&
                                        mouse.usage === one.usage));

  function report(event) {
    const bytes = new Uint8Array(event.data.buffer, event.data.byteOffset, event.data.byteLength);
    Module.ccall('filiform_mouse_reports', null, ['array', 'number'], [[event.reportId, ...bytes], bytes.length + 1]);
  }

  async function open(devices) {
    const ours = devices.filter(isOurs);
    if (ours.length === 0 || opened.length > 0) return;
    opened = ours.filter((device) => device.productId === ours[0].productId);
    try {
      for (const device of opened) {
        if (!device.opened) await device.open();
        device.addEventListener('inputreport', report);
      }
    } catch (failure) {
      opened = [];
      return say('the 3D mouse cannot be opened: ' + failure.message + '; end other programs that use it');
    }
    const {vendorId, productId, productName} = opened[0];
    Module.ccall('filiform_mouse_comes', null, ['number', 'number', 'string'], [vendorId, productId, productName]);
    button.hidden = true;
  }

  function leaves(event) {
    if (!opened.includes(event.device)) return;
    for (const device of opened) device.removeEventListener('inputreport', report);
    opened = [];
    Module.ccall('filiform_mouse_leaves', null, [], []);
    button.hidden = false;
  }

  button.addEventListener('click', async () => {
    button.blur();  // keys go to the window
    if (!navigator.hid) return say(kNoWebHid);
    try {
      const devices = await navigator.hid.requestDevice({filters: kSpaceMice});
      if (!devices.some(isOurs)) return say('no 3D mouse was chosen');
      await open(devices);
    } catch (failure) {
      say('no 3D mouse: ' + failure.message);
    }
  });
  if (navigator.hid) {
    navigator.hid.addEventListener('connect', (event) => open([event.device]));
    navigator.hid.addEventListener('disconnect', leaves);
    navigator.hid.getDevices().then(open);  // those that the user allowed before
  }
  Module.sendReport = (id, value) => {
    for (const device of opened) device.sendReport(id, new Uint8Array([value])).catch(() => {});  // the lamp
  };
  return button;
}
