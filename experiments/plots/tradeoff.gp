# Pictures of the price of accuracy.
#
#   gnuplot -e "folder='docs/pictures'" experiments/plots/tradeoff.gp
#
# reads tradeoff.csv of `tessera experiment tradeoff --csv` in the same folder.
if (!exists("folder")) folder = "docs/pictures"
rows = folder . "/tradeoff.csv"
set datafile separator ","
set terminal svg size 1100,760 font "sans,11" noenhanced background "white"
set output folder . "/tradeoff.svg"
set grid
set logscale xy
set format x "%g"
set format y "%.0e"
set key at screen 0.5,0.015 center horizontal
set multiplot layout 2,3 margins 0.07,0.98,0.1,0.9 spacing 0.07,0.14 title "Error against cost, single precision: Bullet's own solver, small steps, and the front of all"
pick(scene, more) = sprintf("< awk -F, '$1==\"%s\" && $2==\"f32\" && $8>0 && %s' %s", scene, more, rows)
front(scene) = sprintf("< awk -F, '$1==\"%s\" && $2==\"f32\" && $8>0 && $14==1' %s | sort -t, -g -k11", scene, rows)
do for [scene in "collision stack pile chain rolling orbit"] {
  set title scene
  set xlabel "us by body and second"
  set ylabel (scene eq "pile" ? "overlap, m" : "error, m")
  plot pick(scene, "$6==1") using 11:8 with points pt 7 ps 0.5 lc "red" title "1 step", \
       pick(scene, "$6>1") using 11:8 with points pt 7 ps 0.5 lc "blue" title "small steps", \
       pick(scene, "$3==\"default\"") using 11:8 with points pt 8 ps 1.5 lc "black" title "default", \
       front(scene) using 11:8 with lines lc "gray" title "front"
}
unset multiplot
