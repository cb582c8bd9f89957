// The documentation as pages of the site: dist/docs from docs/*.md and the files in the root, with one navigation over all.
import { cpSync, existsSync, mkdirSync, readFileSync, readdirSync, statSync, writeFileSync } from 'node:fs';
import { dirname, join, posix } from 'node:path';
import { apiReference } from './api-reference.mjs';
import { root } from './environment.mjs';
import { escape, render } from './markdown.mjs';
import { StepError } from './run.mjs';

/** Pages by their files in the site. Those that no group names are in the one that is said to take the rest of their folder. */
const groups = [
  { title: 'Use', pages: ['index.html', 'viewer.html', 'embedding.html', 'api.html', 'parameters.html', 'formats.html', 'changelog.html'] },
  {
    title: 'Techniques',
    pages: ['restir-di', 'restir-di-decoupled', 'restir-report', 'ris', 'path-tracer', 'normals'].map((id) => `techniques/${id}.html`),
    rest: 'techniques',
  },
  {
    title: 'Internals',
    pages: ['conventions', 'materials', 'lights', 'textures', 'motion', 'architecture', 'adding-a-technique', 'testing', 'contributing'].map((name) => `${name}.html`),
    rest: '.',
  },
  { title: 'Measurements', pages: ['performance.html', 'lab.html', 'lab/index.html'], rest: 'lab' },
];

/** Pages of the lab are many: they are listed where one reads of the lab. */
const inLab = (file) => file === 'lab.html' || file.startsWith('lab/');

/** The overview is the file that greets whoever sees the repository. */
const fromRoot = { 'README.md': 'index.html', 'CONTRIBUTING.md': 'contributing.html', 'CHANGELOG.md': 'changelog.html' };
const titles = { 'index.html': 'Overview', 'parameters.html': 'Parameters', 'lab/index.html': 'What it has measured' };

/** Every Markdown file with its page's place in dist/docs, as posix paths from the repository's root and from there. */
function sources() {
  const found = new Map(Object.entries(fromRoot));
  const visit = (folder) => {
    for (const name of readdirSync(join(root, folder)).sort()) {
      const path = posix.join(folder, name);
      if (statSync(join(root, path)).isDirectory()) visit(path);
      else if (name.endsWith('.md')) found.set(path, posix.relative('docs', path).replace(/README\.md$/, 'index.md').replace(/md$/, 'html'));
    }
  };
  visit('docs');
  return found;
}

/** Width and height of a PNG or SVG, as attributes: the page does not jump when it arrives. */
function sizeOf(path) {
  const bytes = readFileSync(path);
  if (path.endsWith('.png')) return ` width="${bytes.readUInt32BE(16)}" height="${bytes.readUInt32BE(20)}"`;
  const [, width, height] = /<svg[^>]*viewBox="0 0 ([\d.]+) ([\d.]+)"/.exec(bytes.toString('utf8')) ?? [];
  return width ? ` width="${width}" height="${height}"` : '';
}

/** How links and pictures of the file `source` are written in its page. */
function linker(source, pages) {
  const from = posix.dirname(posix.join('docs', pages.get(source)));
  const locate = (href) => {
    const [path, anchor] = href.split('#');
    const target = path ? posix.normalize(posix.join(posix.dirname(source), decodeURI(path))).replace(/\/$/, '') : source;
    if (!existsSync(join(root, target))) throw new StepError(`${source}: ${href} leads nowhere`);
    return { target, hash: anchor === undefined ? '' : `#${anchor}` };
  };
  const link = (href, content) => {
    if (/^[a-z]+:/.test(href)) return `<a href="${escape(href)}">${content}</a>`;
    const { target, hash } = locate(href);
    if (target === source) return `<a href="${hash}">${content}</a>`;
    const inSite = pages.has(target) ? posix.join('docs', pages.get(target)) : statSync(join(root, target)).isFile() && /^(docs|shaders)\//.test(target) && target;
    if (inSite) return `<a href="${posix.relative(from, inSite)}${hash}">${content}</a>`;
    // What else is in the repository is named, for it is not in the site.
    const named = content.replace(/<[^>]*>/g, '').includes(posix.basename(target));
    if (!named) return `${content} (<code>${target}</code>)`;
    return content.includes('<code>') ? content : `<code>${content}</code>`;
  };
  const image = (href, words) => {
    const path = posix.relative(from, locate(href).target);
    const picture = `<img src="${path}" alt="${escape(words)}" loading="lazy"${sizeOf(join(root, locate(href).target))}>`;
    // Strips of pictures are wider than a column.
    return path.endsWith('.png') ? `<a class="picture" href="${path}">${picture}</a>` : picture;
  };
  return { link, image };
}

/** All pages, by group, in the order of the navigation. */
function arrange(pages) {
  const named = new Set(groups.flatMap((group) => group.pages));
  const rest = (folder) => [...pages.keys()].filter((file) => !named.has(file) && posix.dirname(file) === folder).sort();
  return groups.map((group) => ({ title: group.title, pages: [...group.pages, ...(group.rest ? rest(group.rest) : [])].map((file) => pages.get(file)) }));
}

function navigation(arranged, page) {
  const to = (file) => posix.relative(posix.dirname(page.file), file);
  const entry = ({ file, name, sections }) => {
    if (file !== page.file) return `<li><a href="${to(file)}">${escape(name)}</a></li>`;
    const parts = sections.map(({ id, title }) => `<li><a href="#${id}">${escape(title)}</a></li>`).join('\n');
    return `<li><a href="${to(file)}" aria-current="page">${escape(name)}</a>${parts && `\n<ul>\n${parts}\n</ul>`}</li>`;
  };
  const shown = ({ file }) => !file.startsWith('lab/') || file === 'lab/index.html' || inLab(page.file);
  return arranged.map(({ title, pages }) => `<h2>${title}</h2>\n<ul>\n${pages.filter(shown).map(entry).join('\n')}\n</ul>`).join('\n');
}

function whole(arranged, page) {
  const order = arranged.flatMap(({ pages }) => pages);
  const at = order.indexOf(page);
  const to = (file) => posix.relative(posix.dirname(page.file), file);
  const base = to('../').replace(/\/?$/, '/');
  const beside = (other, rel, text) => (other ? `<a rel="${rel}" href="${to(other.file)}">${text(escape(other.name))}</a>` : '<span></span>');
  const title = page.file === 'index.html' ? 'restir' : `${page.title} · restir`;
  return `<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="description" content="${escape(page.lead)}">
<meta name="color-scheme" content="light dark">
<title>${escape(title)}</title>
<link rel="icon" href="${base}icon.svg" type="image/svg+xml">
<link rel="stylesheet" href="${base}docs.css">
</head>
<body>
<header>
<nav aria-label="Site"><b>restir</b> <a href="${base}">Viewer</a> <a href="${to('index.html')}" aria-current="true">Documentation</a> <a href="${base}learn/">Learn</a> <a class="to-contents" href="#site-contents">Contents</a></nav>
</header>
<main>
${page.html}
<nav class="beside" aria-label="Next and previous page">${beside(order[at - 1], 'prev', (name) => `← ${name}`)} ${beside(order[at + 1], 'next', (name) => `${name} →`)}</nav>
</main>
<nav id="site-contents" aria-label="Contents">
${navigation(arranged, page)}
</nav>
<script type="module">
// Where the contents scroll by themselves, the page that is read stands in their middle.
const contents = document.getElementById('site-contents');
contents.scrollTop = contents.querySelector('[aria-current]').offsetTop - contents.clientHeight / 2;
</script>
</body>
</html>
`;
}

/** A first sentence for search engines: the first paragraph, cut at a sentence's end. */
const shortened = (text) => (text.replace(/\s+/g, ' ').match(/^.{1,160}[.:](?= |$)/)?.[0] ?? text.slice(0, 160)).trim();

/** Writes docs/ and shaders/ into `folder`. */
export function buildSite(folder) {
  const files = sources();
  const pages = new Map();
  for (const [source, file] of files) {
    const { html, title, sections, lead } = render(readFileSync(join(root, source), 'utf8'), linker(source, files));
    // What an experiment measured lies beside its page.
    const csv = source.replace(/md$/, 'csv');
    const data = existsSync(join(root, csv)) ? `<p>All that was measured: <a href="${posix.basename(csv)}">${posix.basename(csv)}</a></p>\n` : '';
    pages.set(file, { file, html: html + data, title, sections, lead: shortened(lead), name: titles[file] ?? title });
  }
  const { lead, ...reference } = apiReference();
  pages.set('api.html', { file: 'api.html', name: 'API reference', lead, ...reference });

  // docs/ has nothing but pages, pictures and data.
  cpSync(join(root, 'docs'), join(folder, 'docs'), { recursive: true, filter: (path) => !path.endsWith('.md') });
  cpSync(join(root, 'shaders'), join(folder, 'shaders'), { recursive: true });
  const arranged = arrange(pages);
  for (const page of pages.values()) {
    const path = join(folder, 'docs', page.file);
    mkdirSync(dirname(path), { recursive: true });
    writeFileSync(path, whole(arranged, page));
  }
}
