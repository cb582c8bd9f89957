// The live pictures of a page, and the sliders that set their parameters. Without WebGPU the still pictures stay.

/** Whether pictures can be live here. */
async function hasWebGpu(): Promise<boolean> {
  return Boolean(await navigator.gpu?.requestAdapter().catch(() => null));
}

/** Sets one of a viewer's parameters in its attribute `params`. */
function setParameter(viewer: Element, name: string, value: string): void {
  const others = (viewer.getAttribute('params') ?? '').split(/\s+/).filter((word) => word !== '' && !word.startsWith(`${name}=`));
  viewer.setAttribute('params', [...others, `${name}=${value}`].join(' '));
}

/** Writes the value of a slider beside it: one of those in `data-values`. */
function name(slider: HTMLInputElement): string {
  const value = (slider.dataset['values'] ?? '').split(' ')[Number(slider.value)] ?? '';
  const output = document.querySelector(`output[for="${slider.id}"]`);
  if (output) output.textContent = value;
  slider.setAttribute('aria-valuetext', value);
  return value;
}

/** Lets a slider set `data-parameter` of the viewers whose ids are in `data-viewers`. */
function connect(slider: HTMLInputElement): void {
  const { viewers = '', parameter = '' } = slider.dataset;
  const apply = () => {
    const value = name(slider);
    for (const id of viewers.split(' ')) {
      const viewer = document.getElementById(id);
      if (viewer) setParameter(viewer, parameter, value);
    }
  };
  slider.addEventListener('input', apply);
  apply();
}

/**
 * For those who asked for less motion: moving pictures stay stills, and so do their sliders. True for a slider of such a picture.
 */
function keepStill(): (slider: HTMLInputElement) => boolean {
  const moving = matchMedia('(prefers-reduced-motion: reduce)').matches ? [...document.querySelectorAll('restir-viewer[autoplay]')] : [];
  for (const viewer of moving) viewer.replaceWith(...viewer.children);
  if (moving.length > 0) reveal('.reduced-motion');
  const names = moving.map(({ id }) => id);
  return (slider) => (slider.dataset['viewers'] ?? '').split(' ').some((name) => names.includes(name));
}

function reveal(selector: string): void {
  document.querySelectorAll<HTMLElement>(selector).forEach((sentence) => (sentence.hidden = false));
}

function turnOff(sliders: Iterable<HTMLInputElement>): void {
  for (const slider of sliders) slider.disabled = true;
}

/** Makes the page's viewers live, or says why they are not. */
export async function startViewers(): Promise<void> {
  const sliders = [...document.querySelectorAll<HTMLInputElement>('input[data-parameter]')];
  // A slider that does nothing still says what the still picture was made with.
  sliders.forEach(name);
  if (!(await hasWebGpu())) {
    turnOff(sliders);
    reveal('.no-webgpu');
    return;
  }
  const isStill = keepStill();
  turnOff(sliders.filter(isStill));
  sliders.filter((slider) => !isStill(slider)).forEach(connect);
  await import('../element.js');
}
