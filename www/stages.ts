// The stages of a load, in their order, and how they are shown.

export const stages = ['download', 'parse', 'bvh', 'textures', 'pipelines', 'picture'] as const;

/** Pipelines are made while the renderer starts; the last stage ends with the first frame. */
export type Stage = (typeof stages)[number];

const titles: Record<Stage, string> = {
  download: 'Download',
  parse: 'Parse',
  bvh: 'BVH',
  textures: 'Textures and lights',
  pipelines: 'Pipelines',
  picture: 'First picture',
};

/** So many bytes as a person reads them. */
export function sizeText(bytes: number): string {
  return bytes < 1e6 ? `${Math.ceil(bytes / 1e3)} KB` : `${(bytes / 1e6).toFixed(1)} MB`;
}

/** Lists all stages, with the current one marked, and how many of how many things of it are done. */
export function showStages(list: HTMLOListElement, current: Stage, count?: [done: number, all: number]): void {
  const now = stages.indexOf(current);
  const items = stages.map((stage, at) => {
    const item = document.createElement('li');
    item.textContent = titles[stage];
    if (at < now) item.className = 'done';
    if (at === now) {
      item.setAttribute('aria-current', 'step');
      if (count) item.append(` ${count.join(' of ')}`);
    }
    return item;
  });
  list.replaceChildren(...items);
}
