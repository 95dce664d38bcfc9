# To be sourced by scripts: progress WHAT shows the progress of a task and the estimated time left.
#
# Reads lines that begin with "[DONE/TOTAL]", as ninja writes them, and ignores others. On a terminal it updates one
# line; elsewhere it writes a line every 30 s.
progress() {
  local what=$1 start=$SECONDS said=$SECONDS line elapsed left text
  while IFS= read -r line; do
    [[ $line =~ ^\[([0-9]+)/([0-9]+)\] ]] || continue
    local done=${BASH_REMATCH[1]} total=${BASH_REMATCH[2]}
    elapsed=$((SECONDS - start))
    [ "$done" -gt 0 ] && [ "$elapsed" -gt 0 ] || continue
    left=$((elapsed * (total - done) / done))
    printf -v text '%s: %d%%, about %d:%02d left' "$what" $((100 * done / total)) $((left / 60)) $((left % 60))
    if [ -t 2 ]; then
      [ "$SECONDS" -eq "$said" ] || printf '\r\033[K%s' "$text" >&2
      said=$SECONDS
    elif [ $((SECONDS - said)) -ge 30 ]; then
      said=$SECONDS
      printf '%s\n' "$text" >&2
    fi
  done
  if [ -t 2 ]; then printf '\r\033[K' >&2; fi
}
