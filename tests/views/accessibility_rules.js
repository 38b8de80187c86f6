// What rules of axe-core find, as lists: document and page have a name and a language; controls,
// pictures and lists of choices have names; names of landmarks and ids are unique; what can be
// scrolled can be reached; order of headings; tables have heads.
(() => {
const root = document.querySelector('mbody-viewer')?.shadowRoot ?? document;
const all = (css) => [...root.querySelectorAll(css)];
const seen = (e) => e.getClientRects().length > 0;
const named = (e) => (e.getAttribute('aria-label') || e.getAttribute('aria-labelledby') && root.getElementById?.(e.getAttribute('aria-labelledby'))?.textContent
  || e.labels?.[0]?.textContent || (e.matches('button, a, summary, th') && e.textContent) || '').trim();
const twice = (list) => list.filter((one, n) => list.indexOf(one) !== n);
const role = (e) => e.getAttribute('role') || { SECTION: 'region', NAV: 'navigation', MAIN: 'main' }[e.tagName] || e.tagName;
const levels = all('h1, h2, h3, h4').filter(seen).map((e) => +e.tagName[1]);
return {
  document: [document.documentElement.lang ? '' : 'lang', document.title ? '' : 'title', document.querySelectorAll('main').length === 1 ? '' : 'main'].filter(Boolean),
  controls: all('button, select, input, textarea, summary, a[href], [role=img], svg[tabindex], [role=region]').filter((e) => seen(e) && !named(e)).map((e) => e.outerHTML.slice(0, 80)),
  landmarks: twice(all('section[aria-label], section[aria-labelledby], nav, [role=region]').filter(seen).map((e) => `${role(e)} ${named(e)}`)),
  ids: twice(all('[id]').map((e) => e.id)),
  scrolled: all('*').filter((e) => seen(e) && /auto|scroll/.test(getComputedStyle(e).overflowX) && e.scrollWidth > e.clientWidth + 1 && e.tabIndex < 0 && !e.querySelector('a, button, input, [tabindex]')).map((e) => e.outerHTML.slice(0, 80)),
  headings: levels.filter((level, n) => n && level > levels[n - 1] + 1),
  tables: all('table').filter((e) => seen(e) && e.rows.length > 2 && !e.querySelector('th')).map((e) => e.outerHTML.slice(0, 80)),
  roles: all('[aria-pressed]').filter((e) => !/^(true|false)$/.test(e.getAttribute('aria-pressed'))).map((e) => e.outerHTML.slice(0, 80)),
}; })()
