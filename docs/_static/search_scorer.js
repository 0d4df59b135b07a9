// Order of the results of the search. Sphinx counts one word of the query; here a page comes first
// whose title, or one of whose headings, has many words of the query and few others. Among pages
// that are alike in this, those that say how to do a job come first, and the changelog comes last.
const queryWords = (text) => {
  const stemmer = new Stemmer();
  const isStop = (word) => (stopwords.has ? stopwords.has(word) : stopwords.includes(word));
  const words = splitQuery(text.toLowerCase()).filter((word) => !isStop(word));
  return new Set(words.map((word) => stemmer.stemWord(word)));
};

const headingScore = (wanted, heading) => {
  const words = queryWords(heading);
  const found = [...wanted].filter((word) => words.has(word)).length;
  return found === 0 ? 0 : (found / wanted.size) * (0.7 + (0.3 * found) / words.size);
};

const pageScore = (docname) => {
  if (/^(tutorials|how-to)\//.test(docname)) return 6;
  return /^(reference\/changelog|reliability)$/.test(docname) ? -12 : 0;
};

var Scorer = {
  score: ([docname, title, anchor, description, score, filename, kind]) => {
    const wanted = queryWords(new URLSearchParams(window.location.search).get("q") || "");
    if (wanted.size === 0) return score;
    const number = Search._index.docnames.indexOf(docname);
    const headings = Object.entries(Search._index.alltitles)
      .filter(([, places]) => places.some(([file]) => file === number))
      .map(([heading]) => headingScore(wanted, heading));
    return score + pageScore(docname) + 40 * Math.max(0, ...headings) + 20 * headingScore(wanted, title);
  },
  objNameMatch: 11,
  objPartialMatch: 6,
  objPrio: { 0: 15, 1: 5, 2: -5 },
  objPrioDefault: 0,
  title: 15,
  partialTitle: 7,
  term: 5,
  partialTerm: 2,
};
