// The stages of a load, in their order, and how they are shown.

export const stages = ['download', 'parse', 'bvh', 'textures', 'pipelines', 'picture'] as const;

/** Pipelines are the renderer's start; the last stage ends with the first frame. */
export type Stage = (typeof stages)[number];

const titles: Record<Stage, string> = {
  download: 'Download',
  parse: 'Parse',
  bvh: 'BVH',
  textures: 'Textures and lights',
  pipelines: 'Pipelines',
  picture: 'First picture',
};

/** The stage that the module means by its words. */
export function stageOf(what: string): Stage {
  if (/BVH|meshes/.test(what)) return 'bvh';
  return /mip|lights|done/.test(what) ? 'textures' : 'parse';
}

/** So many bytes as a person reads them. */
export function sizeText(bytes: number): string {
  return bytes < 1e6 ? `${Math.ceil(bytes / 1e3)} KB` : `${(bytes / 1e6).toFixed(1)} MB`;
}

/** Lists all stages, with the current one marked. */
export function showStages(list: HTMLOListElement, current: Stage): void {
  const now = stages.indexOf(current);
  const items = stages.map((stage, at) => {
    const item = document.createElement('li');
    item.textContent = titles[stage];
    if (at < now) item.className = 'done';
    if (at === now) item.setAttribute('aria-current', 'step');
    return item;
  });
  list.replaceChildren(...items);
}
