# Pictures of the seam experiment.
#
#   gnuplot -e "folder='docs/pictures'" experiments/plots/seams.gp
#
# reads seams.csv of `tessera experiment seams --csv` in the same folder.
if (!exists("folder")) folder = "docs/pictures"
rows = folder . "/seams.csv"
set datafile separator ","
set terminal svg size 900,480 font "sans,12" noenhanced background "white"
set grid ytics
set key outside top horizontal

# Errors after 1 s under policy `island`, compared with the noise of rounding.
set output folder . "/seams_error.svg"
set title "Error after 1 s against the run without a seam, policy island, f32"
set ylabel "m"
set logscale y
set format y "%.0e"
set yrange [1e-9:10]
set xtics rotate by -55
few(x) = x < 1e-9 ? 1e-9 : x
pick(placement) = sprintf("< awk -F, '$2==\"%s\" && $3==\"island\" && $4==\"f32\"' %s", placement, rows)
plot pick("local") using 0:(few($7)):xtic(1) with boxes fill solid 0.25 lc "gray" title "noise: other places in one sector", \
     pick("local") using 0:(few($6)) with points pt 7 lc "blue" title "seam", \
     pick("corner") using 0:(few($6)) with points pt 5 lc "red" title "corner of eight sectors"

# Number of scenes that stand.
set output folder . "/seams_stand.svg"
set title "Scenes that stand, f32"
unset logscale y
set format y "%g"
set ylabel "scenes"
set yrange [0:*]
set xtics norotate
set style data histograms
set style histogram clustered
set style fill solid 0.7
count(placement) = sprintf("< awk -F, '$2==\"%s\" && $4==\"f32\" {if (!($3 in n)) order[++k]=$3; n[$3]+=$5} END {for (i=1; i<=k; i++) print order[i] \",\" n[order[i]]}' %s", placement, rows)
plot count("reference") using 2:xtic(1) title "without a seam", \
     count("local") using 2 title "seam", \
     count("remote") using 2 title "seam between two servers", \
     count("corner") using 2 title "corner of eight sectors"
