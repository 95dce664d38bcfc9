# Pictures of the joints experiment.
#
#   gnuplot -e "folder='docs/pictures'" experiments/plots/joints.gp
#
# reads joints.csv of `tessera experiment joints --csv` in the same folder.
if (!exists("folder")) folder = "docs/pictures"
rows = folder . "/joints.csv"
set datafile separator ","
set grid
tick = "$5>0.0166 && $5<0.0168"
few(x, least) = x < least ? least : x

# Gaps and energies at 1/60 s. What is smaller than the scale is drawn at its end.
at_tick(engine, world, more) = sprintf("< awk -F, '$1==\"%s\" && $4==\"%s\" && %s && %s' %s", engine, world, tick, more, rows)
set terminal svg size 1000,820 font "sans,12" noenhanced background "white"
set output folder . "/joints.svg"
set multiplot layout 2,1
set rmargin 8
set xrange [-0.5:*]
set offsets 0, 0.5, 0, 0
set key outside top horizontal
set logscale y
set format y "%.0e"
set xtics rotate by -35
set ylabel "m"
set title "Largest gap of a joint, ticks of 1/60 s"
held = "$2!=\"drive\" && $3!=\"screw\" && $3!=\"fixed\""
set yrange [1e-8:200]
plot at_tick("f32", "plain Bullet", held) using (few($10*1e-6, 1e-8)):xtic(3) with points pt 9 ps 1.2 lc "red" title "plain Bullet, f32", \
     at_tick("f32", "Tessera", held) using (few($10*1e-6, 1e-8)) with points pt 7 lc "blue" title "Tessera, f32", \
     at_tick("f64", "Tessera", held) using (few($10*1e-6, 1e-8)) with points pt 5 lc "dark-green" title "Tessera, f64"
set title "Way from small steps of f64 after 1 s"
set yrange [1e-8:200]
compared = held . " && $16!=\"\""
plot at_tick("f32", "plain Bullet", compared) using (few($16, 1e-8)):xtic(3) with points pt 9 ps 1.2 lc "red" title "plain Bullet, f32", \
     at_tick("f32", "Tessera", compared) using (few($16, 1e-8)) with points pt 7 lc "blue" title "Tessera, f32", \
     at_tick("f64", "Tessera", compared) using (few($16, 1e-8)) with points pt 5 lc "dark-green" title "Tessera, f64"
unset multiplot
unset offsets
unset rmargin
set xrange [*:*]

# Gaps by load.
load(world, time) = sprintf("< awk -F, '$1==\"f32\" && $4==\"%s\" && $3 ~ /^load_/ && $5>%g && $5<%g {sub(/load_/, \"\", $3); print $3 \",\" $10}' %s", world, 0.99*time, 1.01*time, rows)
set terminal svg size 900,480 font "sans,12" noenhanced background "white"
set output folder . "/joints_load.svg"
set title "A chain of 10 links of 1 kg that swings with a load: largest gap of a joint, f32"
set xlabel "kg, of the load"
set logscale x
set xtics norotate
set yrange [1e-8:1000]
plot load("plain Bullet", 1.0/60) using 1:($2*1e-6) with linespoints pt 9 lc "red" title "plain Bullet, 1/60 s", \
     load("plain Bullet with 100 passes", 1.0/60) using 1:($2*1e-6) with linespoints pt 8 lc "dark-red" title "100 passes", \
     load("plain Bullet", 1.0/1000) using 1:($2*1e-6) with linespoints pt 10 lc "orange" title "1/1000 s", \
     load("Tessera", 1.0/60) using 1:($2*1e-6) with linespoints pt 7 lc "blue" title "Tessera, 1/60 s", \
     load("Tessera", 1.0/1000) using 1:($2*1e-6) with linespoints pt 6 lc "dark-blue" title "Tessera, 1/1000 s"

# Errors by what a second costs, over time steps, substeps and passes.
set terminal svg size 1100,760 font "sans,11" noenhanced background "white"
set output folder . "/joints_cost.svg"
set key at screen 0.5,0.09 center vertical
set multiplot layout 2,3 margins 0.07,0.98,0.2,0.9 spacing 0.07,0.16 title "Way from the reference after 1 s, by what a simulated second costs: time steps, substeps and passes"
cost(engine, world, mechanism) = sprintf("< awk -F, '$1==\"%s\" && $4 ~ /^%s/ && $3==\"%s\" && $16!=\"\"  {print $19/$5*1e-3 \",\" $16}' %s", engine, world, mechanism, rows)
set xlabel "ms by simulated second"
set format x "%g"
do for [mechanism in "pendulum double_pendulum load_1 load_100 bridge net_of_36"] {
  set title mechanism
  set yrange [*:*]
  plot cost("f32", "plain", mechanism) using 1:(few($2, 1e-8)) with points pt 9 lc "red" title "plain Bullet, f32", \
       cost("f32", "Tessera", mechanism) using 1:(few($2, 1e-8)) with points pt 7 lc "blue" title "Tessera, f32", \
       cost("f64", "Tessera", mechanism) using 1:(few($2, 1e-8)) with points pt 5 lc "dark-green" title "Tessera, f64"
}
unset multiplot
