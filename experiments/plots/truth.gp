# Picture of the truth experiment.
#
#   gnuplot -e "folder='docs/pictures'" experiments/plots/truth.gp
#
# reads truth.csv of `tessera experiment truth --csv` in the same folder.
if (!exists("folder")) folder = "docs/pictures"
rows = folder . "/truth.csv"
set datafile separator ","
groups = "rest slide carrier impact through flush flight orbit conserved rays programs"

# Of each quantity of an engine: the place of its group, spread, and its error by its bound, within the scale. Where
# nothing is allowed, an error is at the upper end.
share(engine, sectors, shift) = sprintf("< awk -F, -v groups='%s' 'BEGIN {n = split(groups, names, \" \"); for (i = 1; i <= n; ++i) place[names[i]] = i} $3==\"%s\" && (\"%s\"==\"\" || $4==%s) && $8!=\"\" {error = $8 - $7; if (error < 0) error = -error; ratio = $9 > 0 ? error / $9 : (error > 0 ? 1e6 : 1e-6); if (ratio < 1e-6) ratio = 1e-6; if (ratio > 1e6) ratio = 1e6; print place[$1] + %g + 0.14 * (NR %% 11) / 11 \",\" ratio}' %s", groups, engine, sectors, sectors eq "" ? "0" : sectors, shift, rows)
ours(engine, shift) = share(engine, "128.0", shift)
theirs(engine, shift) = share(engine, "", shift)

set terminal svg size 1100,620 font "sans,12" noenhanced background "white"
set output folder . "/truth.svg"
set title "Error by bound, a point a quantity: what is below the line is right"
set key outside bottom center horizontal
set grid ytics
set logscale y
set yrange [5e-7:2e6]
set format y "10^{%T}"
set ytics enhanced
set xrange [0.4:11.6]
set xtics ("rest" 1, "slide" 2, "carrier" 3, "impact" 4, "through" 5, "flush" 6, "flight" 7, "orbit" 8, "conserved" 9, "rays" 10, "programs" 11)
set ylabel "error / bound"
plot 1 with lines lw 2 lc "black" notitle, \
     ours("f32", -0.40) with points pt 7 ps 0.6 lc "blue" title "Tessera, f32", \
     ours("f64", -0.20) with points pt 5 ps 0.6 lc "dark-green" title "Tessera, f64", \
     theirs("Bullet f32", 0.0) with points pt 9 ps 0.6 lc "red" title "plain Bullet, f32", \
     theirs("MuJoCo", 0.20) with points pt 11 ps 0.6 lc "dark-orange" title "MuJoCo"
