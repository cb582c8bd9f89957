// The reference of the package's API, from its sources: every public member of what viewer.ts and element.ts export, and every
// type that these name.
import { readdirSync } from 'node:fs';
import { join } from 'node:path';
// The compiler's own parser, of the version that package.json pins: its interface is not promised to stay.
import { API } from 'typescript/unstable/sync';
import { getTextOfJSDocComment } from 'typescript/unstable/ast';
import * as is from 'typescript/unstable/ast/is';
import { Marked } from 'marked';
import { root } from './environment.mjs';
import { escape, heading } from './markdown.mjs';

const folder = join(root, 'www');

/** What the two entries of the package hand out, in the order in which it is shown. */
const entries = ['RestirViewer', 'ViewerEventMap', 'RestirViewerElement', 'RestirError'];

/** Called by the browser, never by a page. */
const ofTheBrowser = new Set(['connectedCallback', 'disconnectedCallback', 'attributeChangedCallback', 'observedAttributes']);

const words = new Marked();
const prose = (text) => (text ? words.parse(escape(text).replace(/&quot;/g, '"')) : '');

const docOf = (node) => getTextOfJSDocComment(node.jsDoc?.at(-1)?.comment) ?? '';
const nameOf = (node) => node.name?.text ?? '';
const isOptional = (node) => (node.postfixToken ?? node.questionToken) !== undefined;
const modifier = (node, word) => (node.modifiers ?? []).some((each) => each.getText() === word);
const isPublic = (node) => !modifier(node, 'private') && !modifier(node, 'protected');

/** Interfaces, classes and types of the sources, by name. A class may have an interface beside it, which holds its events only. */
function declarationsOf(program) {
  const found = new Map();
  for (const name of readdirSync(folder).filter((file) => file.endsWith('.ts'))) {
    for (const node of program.getSourceFile(join(folder, name)).statements) {
      if (!is.isInterfaceDeclaration(node) && !is.isClassDeclaration(node) && !is.isTypeAliasDeclaration(node)) continue;
      if (modifier(node, 'export') && !is.isClassDeclaration(found.get(nameOf(node)) ?? node.parent)) found.set(nameOf(node), node);
    }
  }
  return found;
}

/** The anchor of a class or type. */
const idOf = (name) => (name === 'ViewerEventMap' ? 'events' : name.toLowerCase());

const squeezed = (text) => text.replace(/\s+/g, ' ');

/** A parameter as its caller sees it: without names for its parts, and optional where it has a default. */
function parameterText(parameter) {
  const name = is.isIdentifier(parameter.name) ? parameter.name.text : 'options';
  const optional = isOptional(parameter) || parameter.initializer ? '?' : '';
  return `${name}${optional}: ${parameter.type?.getText() ?? 'unknown'}`;
}

/** What a member is declared as, in one line, without its body. */
function signatureOf(node, owner) {
  const parameters = () => node.parameters.map(parameterText).join(', ');
  const type = node.type ? `: ${node.type.getText()}` : '';
  const generics = node.typeParameters?.length ? `<${node.typeParameters.map((each) => each.getText()).join(', ')}>` : '';
  const before = modifier(node, 'static') ? 'static ' : '';
  if (is.isConstructorDeclaration(node)) return squeezed(`new ${owner}(${parameters()})`);
  if (is.isMethodDeclaration(node)) return squeezed(`${before}${nameOf(node)}${generics}(${parameters()})${type}`);
  const readonly = modifier(node, 'readonly') || (is.isGetAccessorDeclaration(node) && !node.settable) ? 'readonly ' : '';
  return squeezed(`${before}${readonly}${node.name.getText()}${isOptional(node) ? '?' : ''}${type}`);
}

/** The public members of a class, in order, each with the title of the part of the file that it opens, if it does. */
function membersOf(node) {
  const members = [];
  const text = node.getSourceFile().text;
  let title;
  for (const member of node.members) {
    title = /^ *\/\/ (.+)$/m.exec(text.slice(member.pos, member.getStart()).replace(/\/\*[^]*?\*\//g, ''))?.[1] ?? title;
    if (!isPublic(member) || ofTheBrowser.has(nameOf(member)) || is.isSetAccessorDeclaration(member)) continue;
    // Of an overloaded method the callers see all declarations but the one with the body.
    const overloaded = members.filter((other) => nameOf(other.node) === nameOf(member) && is.isMethodDeclaration(member));
    if (overloaded.length > 0) {
      if (!member.body) overloaded[0].more.push(member);
      continue;
    }
    member.settable = node.members.some((other) => is.isSetAccessorDeclaration(other) && nameOf(other) === nameOf(member));
    members.push({ node: member, title, more: [] });
    title = undefined;
  }
  return members;
}

/** Every public name of `declarations` becomes a link to its description. */
function linked(text, declarations, used) {
  return escape(text).replace(/[A-Za-z_]\w*/g, (word) => {
    if (!declarations.has(word)) return word;
    used(word);
    return `<a href="#${idOf(word)}">${word}</a>`;
  });
}

/** Renders the page: its HTML, its title, its sections and its first sentence. */
export function apiReference() {
  const api = new API({ cwd: root });
  try {
    const program = api.updateSnapshot({ openProjects: [join(root, 'tsconfig.json')] }).getProjects()[0].program;
    return describe(declarationsOf(program));
  } finally {
    api.close();
  }
}

function describe(declarations) {
  // The wasm module's own class has another reference: its declaration file.
  const order = [...entries];
  const used = (name) => order.includes(name) || order.push(name);
  const signature = (text) => `<pre class="signature"><code>${linked(text, declarations, used)}</code></pre>\n`;
  const member = (owner, node, texts) => {
    const name = is.isConstructorDeclaration(node) ? 'constructor' : nameOf(node);
    return heading(4, `${owner}-${name}`.toLowerCase(), escape(name), name) + texts.map(signature).join('') + prose(docOf(node));
  };
  const classText = (node) => {
    const owner = nameOf(node);
    return membersOf(node)
      .map(({ node: each, title, more }) => {
        const part = title ? `<h3>${escape(title)}</h3>\n` : '';
        return part + member(owner, each, [each, ...more].map((one) => signatureOf(one, owner)));
      })
      .join('');
  };
  const rows = (node) =>
    node.members
      .map((each) => {
        const name = `${each.name.getText().replace(/'/g, '')}${isOptional(each) ? '?' : ''}`;
        const doc = prose(docOf(each)).replace(/^<p>|<\/p>\s*$/g, '');
        return `<tr><td><code>${escape(name)}</code></td><td><code class="type">${linked(squeezed(each.type?.getText() ?? ''), declarations, used)}</code></td><td>${doc}</td></tr>`;
      })
      .join('\n');
  const table = (node) =>
    `<div class="table" tabindex="0" role="group" aria-label="Table"><table>\n<thead><tr><th>name</th><th>type</th><th>meaning</th></tr></thead>\n<tbody>\n${rows(node)}\n</tbody>\n</table></div>\n`;

  const sections = [];
  let body = '';
  // The list grows while it is gone through: by the types that are named on the way.
  for (const name of order) {
    const node = declarations.get(name);
    const events = name === 'ViewerEventMap';
    const title = events ? 'Events' : name;
    sections.push({ id: idOf(name), title });
    body += heading(2, idOf(name), escape(title), title);
    if (events) body += '<p>What <code>addEventListener</code> of both classes takes, and what its listener is given. What is told is in <code>detail</code>.</p>\n';
    const base = node.heritageClauses?.[0]?.types.map((type) => type.getText()).join(', ');
    if (base) body += `<p class="quiet">extends ${linked(base, declarations, used)}</p>\n`;
    body += prose(docOf(node));
    if (is.isClassDeclaration(node)) body += classText(node);
    else if (is.isInterfaceDeclaration(node)) body += table(node);
    else body += signature(`type ${name} = ${squeezed(node.type.getText())}`);
  }
  const lead = 'The viewer as a class and as an element: what both offer to a page of your own.';
  const intro = `<p>${lead} How to begin is in <a href="embedding.html">Embedding</a>. The package <code>restir</code> hands out <a href="#restirviewer">RestirViewer</a> and all types below, <code>restir/element</code> the same and <a href="#restirviewerelement">RestirViewerElement</a>, and <code>restir/wasm</code> the bare wasm module, which its declaration file describes. The API of the Rust crate: <code>cargo doc --open</code>.</p>\n`;
  return { html: heading(1, 'api-reference', 'API reference', 'API reference') + intro + body, title: 'API reference', sections, lead };
}
