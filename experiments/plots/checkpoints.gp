# A picture of the price of checkpoints.
#
#   gnuplot -e "folder='docs/pictures'" experiments/plots/checkpoints.gp
#
# reads checkpoints.csv of `tessera experiment checkpoints --csv` in the same folder.
if (!exists("folder")) folder = "docs/pictures"
rows = folder . "/checkpoints.csv"
set datafile separator ","
set terminal svg size 640,400 font "sans,11" noenhanced background "white"
set output folder . "/checkpoints.svg"
set grid
set logscale x
set xtics (0.25, 0.5, 1, 2, 4)
set xlabel "seconds from checkpoint to checkpoint"
set ylabel "percent more time a tick"
set key top right
set title "What checkpoints cost, single precision, two servers and a store"
pick(scene) = sprintf("< awk -F, '$2==\"%s\" && $1==\"f32\" && $4>0' %s", scene, rows)
plot 5 with lines dt 2 lc "gray" title "5 %", \
     pick("pile") using 4:8 with linespoints pt 7 ps 0.7 lc "red" title "8,192 boxes awake", \
     pick("resting") using 4:8 with linespoints pt 7 ps 0.7 lc "blue" title "8,192 boxes at rest, 512 balls"
