// What passes compute, in MathML, by their ids. Sources are in the head of each pass's file.

const text = (content: string) => `<mi>${content}</mi>`;
const row = (...parts: string[]) => `<mrow>${parts.join('')}</mrow>`;
const operator = (content: string) => `<mo>${content}</mo>`;
/** No taller than a letter, whatever it holds. */
const bracket = (content: string) => `<mo stretchy="false">${content}</mo>`;
const number = (content: string) => `<mn>${content}</mn>`;
const sub = (base: string, index: string) => `<msub>${base}${index}</msub>`;
const over = (above: string, below: string) => `<mfrac>${above}${below}</mfrac>`;
const sum = (index: string) => `<munder>${operator('∑')}${text(index)}</munder>`;
const of = (name: string, argument: string) => row(name, bracket('('), argument, bracket(')'));
const hat = `<mover accent="true">${text('p')}${operator('^')}</mover>`;
const i = text('i');
const xi = sub(text('x'), i);
const is = operator('=');

const selection = row(text('W'), is, over(number('1'), of(hat, text('y'))), sum('i'), sub(text('w'), i));
const offered = row(sub(text('w'), i), is, of(sub(text('m'), i), xi), of(hat, xi), sub(text('W'), i));
const balance = row(
  of(sub(text('m'), i), text('x')), is,
  over(row(sub(text('c'), i), of(sub(hat, i), text('x'))), row(sum('j'), sub(text('c'), text('j')), of(sub(hat, text('j')), text('x')))),
);
const drawn = row(sub(text('w'), i), is, over(number('1'), text('M')), over(of(hat, xi), of(text('p'), xi)));
const shaded = row(text('L'), is, sub(text('L'), text('e')), operator('+'), of(text('f'), text('y')), of(text('G'), text('y')), of(text('V'), text('y')), text('W'));

/** Lines of equations, and a word on each. */
const known: Record<string, [string, string][]> = {
  'restir-di/initial': [[drawn, 'The weight of each of M candidates'], [selection, 'The weight of the one that is chosen, y']],
  'restir-di/temporal': [[offered, 'What the pixel and its history offer'], [balance, 'Who speaks for it: one choice of reuse_weights'], [selection, 'The weight of the one that is chosen, y']],
  'restir-di/spatial': [[offered, 'What the pixel and its neighbours offer'], [balance, 'Who speaks for it: one choice of reuse_weights'], [selection, 'The weight of the one that is chosen, y']],
  'restir-di/shade': [[shaded, 'The estimate of direct light, with a shadow ray']],
  'restir-report/initial': [[drawn, 'The weight of each of M candidates'], [selection, 'The weight of the one that is chosen, y']],
  'restir-report/temporal': [[offered, 'What the pixel and its history offer'], [selection, 'The weight of the one that is chosen, y']],
  'restir-report/spatial': [[offered, 'What the pixel and its neighbour offer'], [selection, 'The weight of the one that is chosen, y']],
  'restir-report/shade': [[shaded, 'The estimate of direct light, with a shadow ray']],
  'restir-di-decoupled/select': [[drawn, 'The weight of each of M lights of the tile'], [selection, 'The weight of the candidate that is chosen, y']],
  'restir-di-decoupled/shade': [[row(text('L'), is, sum('i'), of(sub(text('m'), i), xi), of(text('f'), xi), of(text('V'), xi), sub(text('W'), i)), 'All three samples are shaded']],
  'ris/ris': [[drawn, 'The weight of each of M candidates'], [selection, 'The weight of the one that is chosen, y'], [shaded, 'Its estimate, with a shadow ray']],
  'film/accumulate': [[row(sub(text('S'), text('n')), is, sub(text('S'), row(text('n'), operator('−'), number('1'))), operator('+'), sub(text('L'), text('n'))), 'The sum of all frames']],
  'film/display': [[over(sub(text('S'), text('n')), text('n')), 'The mean of all frames, exposed and tone-mapped']],
};

/** The equations of a pass as a list; nothing where it has none. */
export function equationsOf(id: string): HTMLElement | undefined {
  const lines = known[id];
  if (!lines) return undefined;
  const list = document.createElement('dl');
  list.className = 'equations';
  list.innerHTML = lines.map(([formula, words]) => `<dt><math display="block">${formula}</math></dt><dd>${words}</dd>`).join('');
  return list;
}
