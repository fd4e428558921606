// SPDX-License-Identifier: GPL-3.0-or-later
// The image wall: two pictures, one wiped over the other; WALLS holds them per scene and pass.
document.querySelectorAll('.wall').forEach(wall => {
  const data = WALLS[+wall.dataset.scene];
  const q = selector => wall.querySelector(selector);
  const wipe = q('.wipe');
  const fill = (select, names, index) => {
    select.innerHTML = '';
    names.forEach(name => select.add(new Option(name)));
    select.selectedIndex = Math.min(index, names.length - 1);
  };
  const show = () => {
    const shown = data[q('.pass').value], left = q('.left').value, right = q('.right').value;
    q('.top').src = q('.heat').checked && shown[left].heat ? shown[left].heat : shown[left].image;
    q('.base').src = shown[right].image;
    q('.tag.l').textContent = left;
    q('.tag.r').textContent = right;
  };
  const choose = () => {
    const names = Object.keys(data[q('.pass').value]);
    fill(q('.left'), names, 2);
    fill(q('.right'), names, 0);
    show();
  };
  fill(q('.pass'), Object.keys(data), 0);
  choose();
  q('.pass').onchange = choose;
  ['.left', '.right', '.heat'].forEach(selector => { q(selector).onchange = show; });
  const move = event => {
    const box = wipe.getBoundingClientRect();
    const share = Math.min(1, Math.max(0, (event.clientX - box.left) / box.width));
    wipe.style.setProperty('--x', 100 * share + '%');
  };
  wipe.onpointermove = move;
  wipe.onpointerdown = move;
});
document.body.dataset.ready = '1';
