// From the documentation's Markdown to HTML: what GitHub shows, with formulas as MathML.
import { Marked } from 'marked';
import temml from 'temml';

export const escape = (text) => text.replace(/[&<>"]/g, (sign) => ({ '&': '&amp;', '<': '&lt;', '>': '&gt;', '"': '&quot;' })[sign]);

const unescape = (html) => html.replace(/&(amp|lt|gt|quot|#39);/g, (_, name) => ({ amp: '&', lt: '<', gt: '>', quot: '"', '#39': "'" })[name]);

/** What HTML says, without its formulas. */
const textOf = (html) => unescape(html.replace(/<math.*?<\/math>/gs, '').replace(/<[^>]*>/g, ''));

/** MathML of a formula; throws where it is none. */
function formula(text, displayMode) {
  return temml.renderToString(text, { displayMode, throwOnError: true });
}

/** What is wider than a phone is scrolled by itself, by keys, too. */
const scrolling = (name, label, html) => `<div class="${name}" tabindex="0" role="group" aria-label="${label}">${html}</div>\n`;

/** `$x$` within a line. A price or a shell variable is none: those have a space beside a sign, or stand in code. */
const inlineFormula = {
  name: 'formula',
  level: 'inline',
  start: (text) => text.indexOf('$'),
  tokenizer(text) {
    const found = /^\$(?!\s)((?:\\.|[^$\\])+?)(?<!\s)\$(?!\d)/.exec(text);
    return found ? { type: 'formula', raw: found[0], text: found[1] } : undefined;
  },
  // Browsers do not break formulas into lines: one that a phone may have no room for is scrolled.
  renderer: ({ text }) => (text.length > 40 ? `<span class="long">${formula(text, false)}</span>` : formula(text, false)),
};

// A comment or a string: only comments are set apart, but what looks like one within a string is none.
const script = /("(?:\\.|[^"\\\n])*")|((?:^|(?<=\s))#.*)/gm;
const curly = /("(?:\\.|[^"\\\n])*"|'(?:\\.|[^'\\\n])*')|(\/\/.*)/g;
const comments = { sh: script, toml: script, rust: curly, wgsl: curly, js: curly };

function code(text, language) {
  const pattern = comments[language];
  if (!pattern) return escape(text);
  let [html, at] = ['', 0];
  for (const match of text.matchAll(pattern)) {
    html += escape(text.slice(at, match.index)) + (match[2] === undefined ? escape(match[0]) : `<i>${escape(match[0])}</i>`);
    at = match.index + match[0].length;
  }
  return html + escape(text.slice(at));
}

/** The anchor of a heading, as GitHub makes it. */
export const slug = (title) =>
  title.trim().toLowerCase().replace(/[^\p{Alphabetic}\p{Number} _-]/gu, '').replace(/ /g, '-');

/** Gives each of a page's anchors once. */
function anchors() {
  const taken = new Map();
  return (title) => {
    const name = slug(title);
    const before = taken.get(name) ?? 0;
    taken.set(name, before + 1);
    return before ? `${name}-${before}` : name;
  };
}

export function heading(depth, id, html, plain) {
  const link = depth > 1 ? ` <a class="anchor" href="#${id}" aria-label="Link to “${escape(plain)}”">#</a>` : '';
  return `<h${depth} id="${id}">${html}${link}</h${depth}>\n`;
}

/**
 * Renders one page. `link` gives the HTML of a link from its address and content, `image` that of a picture from its address and
 * words. Beside the HTML it returns the title, the sections (headings of the second level), and the first paragraph as text.
 */
export function render(markdown, { link, image }) {
  const [sections, anchor] = [[], anchors()];
  let [title, lead] = ['', ''];
  const renderer = {
    heading({ tokens, depth }) {
      const html = this.parser.parseInline(tokens);
      const text = textOf(html);
      const id = anchor(text);
      if (depth === 1) title ||= text;
      if (depth === 2) sections.push({ id, title: text });
      return heading(depth, id, html, text);
    },
    paragraph({ tokens }) {
      const html = this.parser.parseInline(tokens);
      if (title) lead ||= textOf(html);
      return `<p>${html}</p>\n`;
    },
    code({ text, lang }) {
      if (lang === 'math') return scrolling('equation', 'Equation', formula(text, true));
      return scrolling('code', 'Code', `<pre><code>${code(text, lang)}</code></pre>`);
    },
    table(token) {
      // A measured value and its error stay together.
      const named = ({ align, text }) => [align, / ± /.test(text) && 'measured'].filter(Boolean).join(' ');
      const cell = (each, tag) => `<${tag}${named(each) && ` class="${named(each)}"`}>${this.parser.parseInline(each.tokens)}</${tag}>`;
      const cells = (row, tag) => row.map((each) => cell(each, tag)).join('');
      const rows = token.rows.map((row) => `<tr>${cells(row, 'td')}</tr>`).join('\n');
      return scrolling('table', 'Table', `<table>\n<thead><tr>${cells(token.header, 'th')}</tr></thead>\n<tbody>\n${rows}\n</tbody>\n</table>`);
    },
    // Long names may be broken where a person would break them.
    codespan: ({ text }) => `<code>${escape(text).replace(/(?<=\w)([_.]|=)(?=\w)/g, '$1<wbr>')}</code>`,
    link({ href, tokens }) {
      return link(href, this.parser.parseInline(tokens));
    },
    image: ({ href, text }) => image(href, text),
    // The only HTML that pages have are the marks around generated tables.
    html: ({ text }) => (/^<!--[^]*-->\s*$/.test(text) ? '' : escape(text)),
  };
  try {
    const html = new Marked({ extensions: [inlineFormula], renderer }).parse(markdown);
    return { html, title, sections, lead };
  } catch (error) {
    // A dead link or a wrong formula is the page's fault, though the parser asks for a report of its own.
    error.message = error.message.replace(/\nPlease report this.*/s, '');
    throw error;
  }
}
