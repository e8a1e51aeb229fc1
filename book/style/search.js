// Finds the words of `?q=` in the sections that search-index.js lists: all of them must occur, as a word or the beginning of one.

const words = (new URLSearchParams(location.search).get('q') || '').toLowerCase().split(/\s+/).filter(Boolean);

// How often the words stand in the text, at the beginning of a word; 0 if one of them does not.
function matches(text) {
  const counts = words.map((word) => {
    let count = 0;
    for (let at = text.indexOf(word); at >= 0; at = text.indexOf(word, at + 1)) {
      if (at === 0 || !/[\p{L}\p{N}]/u.test(text[at - 1])) count += 1;
    }
    return count;
  });
  return counts.includes(0) ? 0 : counts.reduce((sum, count) => sum + Math.min(count, 5), 0);
}

// A word in the heading is worth more than many in the text; a page of the text more than a record.
function score([file, , page, title, text]) {
  const all = `${page} ${title} ${text}`.toLowerCase();
  const found = matches(all);
  if (found === 0) return 0;
  return (found + 20 * matches(`${page} ${title}`.toLowerCase())) * (file.startsWith('record-') ? 0.2 : 1);
}

function excerpt(text) {
  const at = Math.max(0, text.toLowerCase().indexOf(words[0]) - 80);
  return (at > 0 ? '… ' : '') + text.slice(at, at + 240) + (text.length > at + 240 ? ' …' : '');
}

function shown([file, place, page, title, text]) {
  const item = document.createElement('li');
  const link = document.createElement('a');
  link.href = place ? `${file}#${place}` : file;
  link.textContent = title && title !== page ? `${page}: ${title}` : page;
  const words = document.createElement('p');
  words.textContent = excerpt(text);
  item.append(link, words);
  return item;
}

document.querySelector('input[type=search]').value = words.join(' ');
if (words.length > 0) {
  const found = SECTIONS.map((section) => [score(section), section]).filter(([value]) => value > 0).sort((a, b) => b[0] - a[0]);
  document.getElementById('found').textContent = `${found.length} sections have ${words.join(' ')}` + (found.length > 40 ? '; the first 40:' : ':');
  document.getElementById('results').append(...found.slice(0, 40).map(([, section]) => shown(section)));
} else {
  document.getElementById('found').textContent = 'Write a word or several into the field at the top.';
}
