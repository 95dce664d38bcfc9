# Pictures of the paper's figures.
#
#   gnuplot -e "folder='docs/pictures'" experiments/plots/paper.gp
#
# reads distance.csv, instances.csv, overhead.csv, overhead_ticks.csv and stacks_edges.csv of
# `tessera experiment ... --csv` in the same folder.
if (!exists("folder")) folder = "docs/pictures"
set datafile separator ","
set grid
set key outside bottom center horizontal

# Fig. 5: error against distance. Zero error is drawn at the bottom.
distance = folder . "/distance.csv"
none = 1e-16
shown(x) = x < none ? none : x
pick(system, engine, size, observers) = sprintf("< awk -F, '$1==\"%s\" && $2==\"%s\" && $3==\"%s\" && $4==%d && $5!=\"\" && $8!=\"\"' %s", system, engine, size, observers, distance)
set terminal svg size 900,480 font "sans,12" noenhanced background "white"
set output folder . "/distance.svg"
set title "Two balls collide: error after 1 s, by their distance from the origin"
set xlabel "distance, 2^k m"
set ylabel "error, m (bottom: the same bits)"
set logscale y
set format y "%.0e"
set yrange [none/10:100]
plot pick("one-world", "f32", "", 1) using 5:(shown($8)) with linespoints pt 7 ps 0.5 lc "red" title "one world, f32", \
     pick("one-world", "f64", "", 1) using 5:(shown($8)) with linespoints pt 7 ps 0.5 lc "orange" title "one world, f64", \
     pick("origin-shift", "f32", "", 2) using 5:(shown($8)) with points pt 6 lc "dark-red" title "shifted origin, 2 observers, f32", \
     pick("lpss", "f32", "128", 1) using 5:(shown($8)) with linespoints pt 5 ps 0.6 lc "blue" title "sectors of 128 m, f32", \
     pick("lpss", "f64", "128", 1) using 5:(shown($8)) with points pt 4 lc "dark-green" title "sectors of 128 m, f64"

# The same inside a sector: precision decreases away from its centre and recovers in the next.
inside = folder . "/distance_inside.csv"
set output folder . "/distance_inside.svg"
set title "The same collision across three sectors of 128 m, f32"
set xlabel "distance, m"
set ylabel "error, m"
set yrange [1e-9:1e-2]
plot sprintf("< awk -F, '$1==\"one-world\" && $2==\"f32\" && $3==128' %s", inside) using 4:($5 < 1e-9 ? 1e-9 : $5) with lines lc "red" title "one world", \
     sprintf("< awk -F, '$1==\"lpss\" && $2==\"f32\" && $3==128' %s", inside) using 4:($5 < 1e-9 ? 1e-9 : $5) with lines lc "blue" title "sectors"

# Fig. 6: the cost of more sectors.
instances = folder . "/instances.csv"
set output folder . "/instances.svg"
set title "128 balls in 1 to 128 sectors: time of a tick, by that of one sector"
set xlabel "sectors"
set ylabel "ratio"
set logscale x 2
unset logscale y
set format y "%g"
set yrange [0:*]
plot sprintf("< awk -F, '$1==\"f32\"' %s", instances) using 2:6 with linespoints pt 7 lc "blue" title "f32", \
     sprintf("< awk -F, '$1==\"f64\"' %s", instances) using 2:6 with linespoints pt 5 lc "dark-green" title "f64"

# Fig. 7: the time of a tick by phase, and the whole tick compared with plain Bullet.
overhead = folder . "/overhead.csv"
ticks = folder . "/overhead_ticks.csv"
array phases[8] = ["sectorization", "seam search", "exchange", "cloning", "detection", "islands", "solving", "integration"]
part(phase) = sprintf("< awk -F, '$1==\"f32\" && $2==\"island\" && $3==4 && $5==\"%s\"' %s", phase, overhead)
whole(engine, seams, substeps) = sprintf("< awk -F, '$1==\"%s\" && $2==\"%s\" && $3==%d' %s", engine, seams, substeps, ticks)
set terminal svg size 1100,500 font "sans,12" noenhanced background "white"
set output folder . "/overhead.svg"
set multiplot layout 1,2
set title "Phases of a tick, f32, default settings"
set xlabel "bodies"
set ylabel "share of the tick, %"
unset logscale x
set xtics rotate by -45
set yrange [0:105]
set style fill solid 0.85
set boxwidth 0.8
set style histogram rowstacked
plot for [n = 1:8] part(phases[n]) using (100*$7):xtic(4) with histograms title phases[n]
set title "Time of a tick by that of plain Bullet"
set ylabel "ratio"
set logscale x 2
set yrange [0:*]
plot whole("f32", "island", 1) using 4:12 with linespoints pt 7 lc "blue" title "Bullet's own solver, f32", \
     whole("f32", "clone", 1) using 4:12 with linespoints pt 6 lc "red" title "the same, the paper's clones", \
     whole("f32", "island", 4) using 4:12 with linespoints pt 5 lc "black" title "4 small steps (default), f32", \
     whole("f64", "island", 4) using 4:12 with linespoints pt 4 lc "dark-green" title "4 small steps, f64", \
     1 with lines dt 2 lc "gray" title "plain Bullet"
unset multiplot
set xtics norotate

# Fig. 8: towers after 10 s.
edges = folder . "/stacks_edges.csv"
set terminal svg size 1200,640 font "sans,11" noenhanced background "white"
set output folder . "/stacks.svg"
unset logscale x
unset xlabel
unset ylabel
unset key
set multiplot layout 2,5 title "Towers of ten boxes after 10 s, single precision: one world above, sectors below"
set size ratio -1
set xrange [-6:6]
set yrange [-1:12]
do for [system in "one-world lpss"] {
  do for [n = 1:5] {
    place = n == 1 ? "origin" : n == 2 ? "2^24 m" : n == 3 ? "2^40 m" : n == 4 ? "2^53 m" : "2^62 sectors"
    set title place
    plot sprintf("< awk -F, '$1==\"%s\" && $2==\"f32\" && $3==\"%s\" {print $5\",\"$6; if (++k %% 2 == 0) print \"\"}' %s", system, place, edges) using 1:2 with lines lc rgb (system eq "lpss" ? "blue" : "red")
  }
}
unset multiplot
