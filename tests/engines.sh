#!/usr/bin/env bash
# Studies on real engines: Debian's Slurm, a controller and two nodes on this machine, and GNU parallel. Runs are disturbed in ten ways
# and must end complete, each time with the bytes of a local run that nothing disturbs. Nothing of the system is touched: keys, state,
# sockets and logs are in a directory of their own, and every listener is on the loopback.
#
# usage: tests/engines.sh TWIN [TIMES [KIND...]]     (default: each kind once; kinds are the functions disturb_* below)
#        GNSS_TWIN_WRITE_ENGINES names the page that a run of all kinds writes (reports/engines.md).
# exit:  0 all of it holds; 1 it does not; 75 Slurm, munge or parallel could not be installed.
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
twin=$(realpath "$1")
times=${2:-1}
shift $(($# < 2 ? $# : 2))
kinds=("$@")
[ ${#kinds[@]} -gt 0 ] || kinds=(nothing task script node controller cancel truncate temporary requeue submitter parallel)

need() { command -v "$1" >/dev/null; }
if ! { need slurmctld && need slurmd && need munged && need parallel; }; then
    { apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends \
        slurm-wlm munge parallel; } >/dev/null 2>&1 || true
fi
need slurmctld && need slurmd && need munged && need parallel || {
    echo "engines: cannot install slurm-wlm, munge and parallel here" >&2
    exit 75
}

work=$(mktemp -d)
chmod 711 "$work"
say() { printf '%s  %s\n' "$(date -u +%T)" "$*"; }

# ---- a cluster of this machine alone
host=$(hostname -s)
export SLURM_CONF=$work/slurm.conf
base=$((20000 + RANDOM % 10000))

node_up() {
    slurmd -f "$SLURM_CONF" -N "$1"
}

controller_up() {
    slurmctld -f "$SLURM_CONF"
}

nodes_are_idle() {
    local try
    for try in $(seq 120); do
        [ "$(sinfo --noheader --Node --format %t 2>/dev/null | grep -c '^idle$')" -eq 2 ] && return 0
        scontrol update nodename=n1,n2 state=resume 2>/dev/null || true
        sleep 0.5
    done
    sinfo >&2
    tail -5 "$work"/log/* >&2
    return 1
}

cluster_up() {
    mkdir -p "$work"/{state,spool/n1,spool/n2,log} && mkdir -m 700 "$work/munge"
    head -c 1024 /dev/urandom >"$work/munge/key"
    chmod 600 "$work/munge/key"
    munged --force --key-file="$work/munge/key" --socket="$work/munge/socket" --pid-file="$work/munge/pid" \
        --log-file="$work/munge/log" --seed-file="$work/munge/seed"
    cat >"$SLURM_CONF" <<CONF
ClusterName=engines
SlurmctldHost=$host(127.0.0.1)
SlurmUser=$(id -un)
SlurmdUser=$(id -un)
AuthType=auth/munge
AuthInfo=socket=$work/munge/socket,cred_expire=5
CommunicationParameters=NoInAddrAny,NoCtldInAddrAny
SlurmctldPort=$base
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool/%n
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd-%n.pid
SlurmctldLogFile=$work/log/slurmctld
SlurmdLogFile=$work/log/slurmd-%n
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SlurmdParameters=config_overrides
MpiDefault=none
ReturnToService=2
SlurmdTimeout=8
KillWait=2
SchedulerParameters=batch_sched_delay=0,sched_interval=2
JobCompType=jobcomp/none
AccountingStorageType=accounting_storage/none
SwitchType=switch/none
PropagateResourceLimits=NONE
NodeName=n1 NodeHostname=$host NodeAddr=127.0.0.1 Port=$((base + 1)) CPUs=2 RealMemory=1000
NodeName=n2 NodeHostname=$host NodeAddr=127.0.0.1 Port=$((base + 2)) CPUs=2 RealMemory=1000
PartitionName=main Nodes=n1,n2 Default=YES MaxTime=INFINITE State=UP
CONF
    controller_up
    node_up n1
    node_up n2
    nodes_are_idle
}

# Processes whose command line holds all of these words; never this script.
of() {
    local pid line word
    for pid in $(pgrep -f -- "$1" || true); do
        line=$(tr '\0' ' ' 2>/dev/null <"/proc/$pid/cmdline") || continue
        for word in "$@"; do
            case $line in *"$word"*) ;; *) continue 2 ;; esac
        done
        [ "$pid" = $$ ] || echo "$pid"
    done
}

# Signals processes that may end meanwhile.
signal() {
    local name=$1 pid
    shift
    for pid in "$@"; do kill "-$name" "$pid" 2>/dev/null || true; done
}

cluster_down() {
    scancel --user="$(id -un)" 2>/dev/null || true
    signal KILL $(of "$work/" slurmd) $(of "$work/" slurmctld) $(of slurmstepd) $(of "$work/" "study run") $(of slurm_script)
    [ ! -f "$work/munge/pid" ] || signal TERM "$(cat "$work/munge/pid")"
    sleep 0.5
    rm -rf "$work"
}
trap cluster_down EXIT

# ---- the study: 24 shards, each a second or so on one core
cat >"$work/study.toml" <<'STUDY'
name = "engines"
level = "correlator"
seed = 9
repetitions = 9
keep = ["phase_sigma_deg", "code_sigma_m", "held"]
[measure]
settle_s = 1
duration_s = 600
[[axis]]
key = "receiver.tracking.pll_bandwidth_hz"
values = [5, 10.0, 18]
[[axis]]
key = "signal.cn0_dbhz"
from = 30
to = 44
step = 2
STUDY

wait_for() {
    local what=$1 try
    shift
    for try in $(seq 600); do
        if "$@"; then return 0; fi
        sleep 0.1
    done
    echo "engines: waited a minute for $what" >&2
    return 1
}
there() { [ "$(find "$1/shards" -name '*-of-*.csv' | wc -l)" -ge "$2" ]; }
running() { [ -n "$(of "study run" "$1")" ]; }
job_of() { cat "$1/submit/job"; }

# ---- what happens to a run in the directory $1, some shards of which are there
disturb_nothing() { :; }
disturb_task() { signal KILL $(of "study run" "$1"); }
# The batch script dies, its task goes on: Slurm knows it as failed and never runs it again.
disturb_script() { signal KILL $(of slurm_script); }
# A node dies with all that runs on it, and comes back when its job was given to the other one.
disturb_node() {
    local pid
    signal KILL $(of "slurmd" "-N n1")
    for pid in $(of slurmstepd) $(of "study run" "$1") $(of slurm_script); do
        if grep -qz '^SLURMD_NODENAME=n1$' "/proc/$pid/environ" 2>/dev/null; then signal KILL "$pid"; fi
    done
    sleep 20
    node_up n1
}
disturb_controller() {
    signal KILL $(of slurmctld "$work")
    sleep 3
    controller_up
}
disturb_cancel() { scancel "$(job_of "$1")_[0-11]"; }
disturb_truncate() {
    local shard
    shard=$(find "$1/shards" -name '*-of-*.csv' | sort | head -1)
    truncate -s 200 "$shard"
}
# What a dead process of this machine left, and half a shard under a name of its own.
disturb_temporary() {
    local dead
    dead=$(bash -c 'echo $$')
    echo "half a sha" >"$1/shards/.tmp.$(hostname | tr -cd 'A-Za-z0-9-').$dead.0"
}
# As a site does that needs the nodes for somebody else.
disturb_requeue() {
    local task
    for task in $(squeue --noheader --array --jobs "$(job_of "$1")" --states RUNNING --format %i); do
        scontrol requeue "$task" || true
    done
}
disturb_submitter() { signal KILL $(of "study submit" "$1"); }
disturb_parallel() { signal KILL $(of parallel "run_part"); }

# What the people of a site do: nodes that a restarted controller has drained ("Duplicate jobid") are released.
operator() {
    while kill -0 "$1" 2>/dev/null; do
        if sinfo --noheader --format %T 2>/dev/null | grep -q drained; then
            scontrol update nodename=n1,n2 state=resume 2>/dev/null || true
        fi
        sleep 2
    done
}

submit() {
    if [ "$2" = parallel ]; then
        "$twin" study submit "$1" --engine parallel --at-once 2
    else
        "$twin" study submit "$1" --engine slurm
    fi
}

# One run of one kind: submitted, disturbed when some shards are there, submitted anew where the submitter is what dies.
one() {
    local kind=$1 directory=$2 begun=$SECONDS code=0
    "$twin" study plan "$work/study.toml" -o "$directory" --shards 24 >/dev/null
    submit "$directory" "$kind" >"$directory.log" 2>&1 &
    local submission=$!
    wait_for "the first shards" there "$directory" 2
    wait_for "a running task" running "$directory"
    "disturb_$kind" "$directory"
    operator "$submission" &
    wait "$submission" || code=$?
    if [ "$kind" = submitter ]; then
        [ "$code" -eq 137 ] || { echo "engines: the submitter ended with $code before it was killed" >&2; return 1; }
        code=0
        submit "$directory" "$kind" >>"$directory.log" 2>&1 || code=$?
        grep -q 'is still there: waiting for it' "$directory.log"
    fi
    if [ "$code" -ne 0 ]; then
        cat "$directory.log" >&2
        tail -3 "$directory"/log/* >&2 || true
        echo "engines: $kind: study submit ended with $code" >&2
        return 1
    fi
    "$twin" study merge "$directory" -o "$directory.csv" >/dev/null
    cmp "$directory.csv" "$work/calm.csv"
    # Whatever still runs ends by itself; then nothing half-made is left.
    wait_for "the queue to empty" queue_is_empty
    wait_for "tasks to end" not running "$directory"
    "$twin" study run "$directory" >/dev/null
    [ -z "$(find "$directory/shards" -name '.tmp*')" ]
    nodes_are_idle
    local submissions
    submissions=$(grep -c '^round\|: job' "$directory.log" || true)
    printf '%s\t%s\t%s\n' "$kind" $((SECONDS - begun)) "$submissions" >>"$work/complete"
    say "$kind: complete, bytes equal, $((SECONDS - begun)) s, $submissions submissions"
}
queue_is_empty() { [ -z "$(squeue --noheader)" ]; }
not() { ! "$@"; }

# ---- the page
# A kind in words, and what brings its run to the end.
words() {
    case $1 in
    nothing) echo "nothing|" ;;
    task) echo "the tasks' processes are killed|the script gives itself back to Slurm" ;;
    script) echo "the batch scripts are killed, their tasks live on|the tasks end, or what they lose is submitted again" ;;
    node) echo "a node dies with all that runs on it|Slurm gives its tasks to the other node after 20 s" ;;
    controller) echo "the controller is killed and started again|tasks run twice or are held; all shards are there, the rest is cancelled" ;;
    cancel) echo "half of the array is cancelled|the second submission" ;;
    truncate) echo "a shard is truncated|it is found damaged and computed again" ;;
    temporary) echo "half a shard of a dead process is there|nothing reads it, the next run removes it" ;;
    requeue) echo "running tasks are requeued by the site|they start again" ;;
    submitter) echo "the submitter is killed and started again|it waits for the job that is still there" ;;
    parallel) echo "GNU parallel is killed|the second submission" ;;
    esac
}

# Prints the page; $1 are the seconds of the run of many shards.
write_page() {
    cat <<END
# Studies on engines

What Slurm and GNU parallel lose. A controller and two nodes of one slot each run on one machine: $(slurmd -V).

A study of 24 shards (the last row: 2500) is submitted by \`study submit\` and disturbed once some shards are there. A run is complete when
all shards are whole and the merged table has the bytes of a local run. Without an engine the 24 shards take $calm_s s.

| what happens | complete | a run (s) | submissions | what brings it to the end |
| --- | --- | --- | --- | --- |
END
    local kind
    for kind in "${kinds[@]}"; do
        awk -F'\t' -v kind="$kind" -v words="$(words "$kind")" -v times="$times" '
            $1 == kind { if (!n || $2 < low) low = $2; if ($2 > high) high = $2; if ($3 > most) most = $3; ++n }
            END { split(words, w, "|"); printf "| %s | %d of %d | %s | %s | %s |\n", w[1], n, times, low == high ? low : low " to " high, most, w[2] }
        ' "$work/complete"
    done
    echo "| 2500 shards where an array has indices up to 1000 | 1 of 1 | $1 | 1 | each of 40 tasks runs 62 or 63 shards |"
    printf '\nComplete: %d of %d runs.\n\n' $(($(wc -l <"$work/complete") + 1)) $((${#kinds[@]} * times + 1))
    echo 'A controller that was killed leaves its nodes drained ("Duplicate jobid"): the operators of a site release them, as the test does.'
}

say "a local run that nothing disturbs"
begun=$SECONDS
"$twin" study plan "$work/study.toml" -o "$work/calm" --shards 24 >/dev/null
"$twin" study run "$work/calm"
"$twin" study merge "$work/calm" -o "$work/calm.csv" >/dev/null
calm_s=$((SECONDS - begun))
say "a cluster of two nodes: $(slurmd -V)"
cluster_up
for kind in "${kinds[@]}"; do
    for number in $(seq "$times"); do
        one "$kind" "$work/it's \"$kind\" $number"
    done
done

# ---- more shards than an array may have indices
say "2500 shards at MaxArraySize $(scontrol show config | awk '/MaxArraySize/ { print $3 }')"
sed -e 's/repetitions = 9/repetitions = 625/' -e 's/duration_s = 600/duration_s = 1/' "$work/study.toml" >"$work/many.toml"
"$twin" study plan "$work/many.toml" -o "$work/many" --shards 2500 | tail -2
"$twin" study export slurm "$work/many" --directive=--hold >"$work/many.sh"
grep -q -- '--array=0-1000$' "$work/many.sh"
scancel "$(sbatch --parsable "$work/many.sh")"
begun=$SECONDS
"$twin" study submit "$work/many" --engine slurm --tasks 40
many_s=$((SECONDS - begun))
"$twin" study merge "$work/many" -o "$work/many.csv"
"$twin" study plan "$work/many.toml" -o "$work/alone" --shards 7 >/dev/null
"$twin" study run "$work/alone"
"$twin" study merge "$work/alone" -o "$work/alone.csv" >/dev/null
cmp "$work/many.csv" "$work/alone.csv"
[ -z "${GNSS_TWIN_WRITE_ENGINES:-}" ] || write_page "$many_s" >"$GNSS_TWIN_WRITE_ENGINES"
say "engines: ${#kinds[@]} kinds, $times times each, and 2500 shards: complete, with equal bytes"
