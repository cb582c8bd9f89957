// Makes elements of a page.

/** An HTML element with properties, or a text, and children. */
export function make<Tag extends keyof HTMLElementTagNameMap>(
  tag: Tag,
  given: string | Partial<HTMLElementTagNameMap[Tag]> = {},
  ...children: (Node | string)[]
): HTMLElementTagNameMap[Tag] {
  const element = document.createElement(tag);
  if (typeof given === 'string') element.append(given);
  else Object.assign(element, given);
  element.append(...children);
  return element;
}

/** An SVG element with attributes, and a text. */
export function svgElement(tag: string, attributes: Record<string, string | number>, text?: string): SVGElement {
  const element = document.createElementNS('http://www.w3.org/2000/svg', tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, String(value));
  if (text !== undefined) element.textContent = text;
  return element;
}
