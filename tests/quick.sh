# Sourced by the whole-program tests: quick settings (what is tested is the path, not its quality) and
# the comparison of two projects.
quick=(--set actor.max_frames=4 --set actor.rounds=1 --set actor.refine=1 --set motion.max_iterations=8
  --set motion.node_rounds=2 --set atlas.size=256 --set atlas.packing_trials=200 --quiet)

# But for what may differ: times, logs, the report, MP4s, and the parts of killed writers (.NAME.part*).
same() {
  diff -rq --exclude=report --exclude='*.mp4' --exclude='.*.part*' "$1" "$2"
}
