// The built site, without a browser: no link leads nowhere, and nothing that should be described is missing.
import { strict as assert } from 'node:assert';
import { existsSync, readFileSync, readdirSync } from 'node:fs';
import { join, posix } from 'node:path';
import { test } from 'node:test';
import { dist } from '../scripts/build.mjs';
import { root } from '../scripts/environment.mjs';
import { render, slug } from '../scripts/markdown.mjs';

const filesBelow = (folder) => readdirSync(folder, { recursive: true, withFileTypes: true }).filter((entry) => entry.isFile())
  .map((entry) => posix.join(posix.relative(folder, entry.parentPath ?? entry.path), entry.name)).sort();

const all = new Set(filesBelow(dist));
const text = (file) => readFileSync(join(dist, file), 'utf8');

const valuesOf = (html, attribute) => [...html.matchAll(new RegExp(`\\s${attribute}="([^"]*)"`, 'g'))].map(([, value]) => value.replaceAll('&amp;', '&'));

/**
 * The links, pictures and anchors of a site's pages that lead nowhere. `has` tells whether there is a file, `read` gives a page's
 * HTML.
 */
function broken(pages, has, read) {
  const ids = new Map();
  const idsOf = (file) => ids.get(file) ?? ids.set(file, new Set(valuesOf(read(file), 'id'))).get(file);
  const problems = [];
  for (const page of pages) {
    const html = read(page).replace(/<!--[^]*?-->/g, '');
    for (const link of ['href', 'src', 'poster'].flatMap((attribute) => valuesOf(html, attribute))) {
      if (/^[a-z]+:/.test(link)) continue;
      const [address, anchor] = link.split('#');
      const path = decodeURIComponent(address.split('?')[0]);
      const joined = path ? posix.join(posix.dirname(page), path) : page;
      const target = path.endsWith('/') || joined === '.' ? posix.join(joined, 'index.html') : joined;
      if (!has(target)) problems.push(`${page}: ${link}`);
      else if (anchor && !idsOf(target).has(decodeURIComponent(anchor))) problems.push(`${page}: ${link}: no such anchor`);
    }
    const own = valuesOf(html, 'id');
    for (const id of own.filter((each, at) => own.indexOf(each) !== at)) problems.push(`${page}: two elements are #${id}`);
  }
  return problems;
}

const pages = [...all].filter((file) => file.endsWith('.html'));

test('every link, picture and anchor of the site leads somewhere', () => {
  assert.ok(pages.length > 50 && pages.includes('index.html') && pages.includes('learn/index.html') && pages.includes('docs/index.html'));
  // The tutorials show built-in scenes, which are no files.
  const read = (file) => text(file).replaceAll(/ src="builtin:[^"]*"/g, '');
  assert.deepEqual(broken(pages, (file) => all.has(file), read), []);
});

test('a link that leads nowhere is found', () => {
  const site = {
    'index.html': '<h1 id="top"></h1><a href="docs/#part">a</a><a href="docs/#nothing">b</a><img src="missing.png"><a href="https://example.org/x">c</a>',
    'docs/index.html': '<h2 id="part"></h2><p id="part"></p><a href="../#top">d</a><a href="../index.html?scene=hall#top">e</a><a href="page.html">f</a>',
  };
  const found = broken(Object.keys(site), (file) => file in site, (file) => site[file]);
  assert.deepEqual(found, [
    'index.html: docs/#nothing: no such anchor',
    'index.html: missing.png',
    'docs/index.html: page.html',
    'docs/index.html: two elements are #part',
  ]);
});

test('every page of the documentation is in the site, and in its navigation', () => {
  const sources = filesBelow(join(root, 'docs')).filter((file) => file.endsWith('.md'));
  assert.ok(sources.length > 40);
  const built = sources.map((file) => posix.join('docs', file.replace(/README\.md$/, 'index.md').replace(/md$/, 'html')));
  const linked = valuesOf(text('docs/lab/index.html'), 'href').map((link) => posix.join('docs/lab', link));
  for (const page of [...built, 'docs/index.html', 'docs/api.html', 'docs/changelog.html', 'docs/contributing.html']) {
    assert.ok(all.has(page), `${page} is missing`);
    assert.ok(linked.includes(page), `${page} is not in the contents`);
  }
});

test('every page has a title of its own, a description, one first heading and no formula left as it was typed', () => {
  const docs = pages.filter((file) => file.startsWith('docs/'));
  const titles = docs.map((file) => /<title>(.+)<\/title>/.exec(text(file))?.[1]);
  assert.equal(new Set(titles).size, docs.length, titles.join('\n'));
  for (const file of docs) {
    const html = text(file);
    assert.match(html, /<meta name="description" content="[^"]{10,}">/, file);
    assert.equal(html.match(/<h1/g).length, 1, file);
    assert.doesNotMatch(html.replace(/<code>[^]*?<\/code>/g, ''), /\\(frac|hat|sum)\b|\$[a-z]/, file);
  }
});

test('viewer, tutorials and documentation lead to each other, and shaders are there', () => {
  assert.ok(valuesOf(text('index.html'), 'href').includes('docs/'));
  assert.ok(valuesOf(text('index.html'), 'href').includes('learn/'));
  assert.ok(valuesOf(text('learn/index.html'), 'href').includes('../docs/'));
  for (const link of ['../../', '../index.html', '../../learn/']) assert.ok(valuesOf(text('docs/techniques/ris.html'), 'href').includes(link), link);
  assert.deepEqual(filesBelow(join(root, 'shaders')).filter((file) => !all.has(`shaders/${file}`)), []);
  assert.ok(existsSync(join(dist, 'docs.css')));
});

test('every public member of the classes and every event is in the API reference', () => {
  const reference = text('docs/api.html');
  // The declaration files are the compiler's, the reference is made from the sources.
  const bodyOf = (file, opening) => text(file).split(opening)[1].split('\n}')[0];
  const members = (body) => [...new Set([...body.matchAll(/^ {4}(?!private |protected )(?:(?:static|readonly|get|set) )*(\w+)[(<:?]/gm)].map(([, name]) => name))];
  const ids = valuesOf(reference, 'id');
  const viewer = members(bodyOf('viewer.d.ts', 'export declare class RestirViewer '));
  assert.ok(viewer.length > 40 && viewer.includes('setParam') && viewer.includes('suspended'), viewer.join(' '));
  for (const name of viewer) assert.ok(ids.includes(`restirviewer-${name.toLowerCase()}`), `RestirViewer.${name}`);
  assert.ok(ids.includes('restirviewerelement-viewer'));
  const events = [...bodyOf('viewer-events.d.ts', 'export interface ViewerEventMap ').matchAll(/^ {4}'?([\w-]+)'?: CustomEvent/gm)].map(([, name]) => name);
  assert.ok(events.length >= 8);
  for (const name of events) assert.ok(reference.includes(`<td><code>${name}</code></td>`), name);
  assert.match(reference, /<code>setting\?<\/code>/, 'what may be left out says so');
  // What is private stays so.
  assert.ok(!ids.includes('restirviewer-loop') && !ids.includes('restirviewer-emit') && !reference.includes('rebuild'));
});

test('Markdown becomes what it should', () => {
  const lines = ['# Title', 'Costs $5 and $6, $x_i$.', '', '<!-- note -->', '', '| a | b |', '|---|--:|', '| $p \\mid q$ | `a\\|b_c` |', '', '```sh', 'echo "# no" # yes', '```', '## A & B: `x`'];
  const { html, title, sections } = render(lines.join('\n'), { link: () => '', image: () => '' });
  assert.equal(title, 'Title');
  assert.deepEqual(sections, [{ id: 'a--b-x', title: 'A & B: x' }]);
  assert.match(html, /Costs \$5 and \$6, <math><msub>/);
  assert.match(html, /<td class="right"><code>a\|b_<wbr>c<\/code>/);
  assert.match(html, /echo &quot;# no&quot; <i># yes<\/i>/);
  assert.doesNotMatch(html, /note/);
  assert.equal(slug('Time of each pass, 1/|Z|'), 'time-of-each-pass-1z');
});
