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

# Gaps and energies at 1/60 s. What is not in the numbers is drawn at the bottom.
at_tick(engine, world, more) = sprintf("< awk -F, '$1==\"%s\" && $4==\"%s\" && %s && %s' %s", engine, world, tick, more, rows)
few(x, least) = x < least ? least : x
set terminal svg size 1100,760 font "sans,12" noenhanced background "white"
set output folder . "/joints.svg"
set multiplot layout 2,1
set key outside top horizontal
set logscale y
set format y "%.0e"
set xtics rotate by -35
set title "The largest gap of a joint, ticks of 1/60 s"
set ylabel "m"
set yrange [1e-8:100]
plot at_tick("f32", "plain Bullet", "$2!=\"drive\"") using (few($10*1e-6, 1e-8)):xtic(3) with points pt 9 ps 1.2 lc "red" title "plain Bullet, f32", \
     at_tick("f32", "Tessera", "$2!=\"drive\"") using (few($10*1e-6, 1e-8)) with points pt 7 lc "blue" title "Tessera, f32", \
     at_tick("f64", "Tessera", "$2!=\"drive\"") using (few($10*1e-6, 1e-8)) with points pt 5 lc "dark-green" title "Tessera, f64"
unset multiplot
