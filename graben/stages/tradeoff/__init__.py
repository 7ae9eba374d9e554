"""tradeoff: runs of one stage over a grid of its knobs; error of a number against what it costs."""
