// Is there WebGPU here, and is it a real GPU?

export interface AdapterKind {
  /** A software rasteriser: start small. */
  software: boolean;
}

/** Milliseconds until an adapter is asked for once more: a browser offers none while its GPU process starts again. */
const patience = 300;

const request = () => navigator.gpu.requestAdapter().catch(() => null);

/** Rejects with NO_WEBGPU or NO_ADAPTER, so that a person hears at once what is missing. */
export async function findAdapter(): Promise<AdapterKind> {
  if (!navigator.gpu) {
    const why = isSecureContext ? 'navigator.gpu does not exist.' : 'WebGPU needs https or localhost, and this page came by another way.';
    throw { code: 'NO_WEBGPU', message: why };
  }
  const adapter = (await request()) ?? (await new Promise((resolve) => setTimeout(resolve, patience)).then(request));
  if (!adapter) throw { code: 'NO_ADAPTER', message: 'The browser has WebGPU but offers no adapter.' };
  const { architecture, description, isFallbackAdapter } = adapter.info;
  return { software: isFallbackAdapter || /swiftshader|llvmpipe/i.test(`${architecture} ${description}`) };
}
