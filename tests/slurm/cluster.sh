#!/usr/bin/env bash
# A Slurm cluster on loopback: munge, a controller and two node daemons, all of it below one folder.
#
#   bash tests/slurm/cluster.sh start FOLDER    starts it; export SLURM_CONF=FOLDER/slurm.conf to use it
#   bash tests/slurm/cluster.sh kill FOLDER N   kills node N with every process of its jobs, as a power cut would
#   bash tests/slurm/cluster.sh node FOLDER N   starts node N again
#   bash tests/slurm/cluster.sh stop FOLDER     stops all of it
#
# Needs root, procps, and the Debian packages slurmctld, slurmd, slurm-client and munge.
set -euo pipefail
command=$1 folder=$(realpath -m "$2")
conf=$folder/slurm.conf

fail() {
    printf 'cluster.sh: %s\n' "$*" >&2
    exit 1
}

node() {
    # A session of its own: the node can be killed with all that it has started.
    setsid slurmd -D -N "node$1" -f "$conf" -M >"$folder/node$1.out" 2>&1 &
    echo $! >"$folder/node$1.pid"
}

# The process, its children and theirs, whatever session they have moved to.
tree() {
    local child
    echo "$1"
    for child in $(pgrep -P "$1"); do tree "$child"; done
}

# Kills a node: the daemon first, so that it reports nothing; then the step daemons of its jobs with all they have started.
# A step daemon shows its node only once its script runs: one that has just begun is waited for.
kill_node() {
    local script step
    kill -9 "$(cat "$folder/node$1.pid")" 2>/dev/null || true
    for _ in $(seq 15); do
        for script in $(pgrep -f "$folder/spool.node$1/job" || true); do
            step=$(ps -o ppid= -p "$script" | tr -d ' ') || continue
            # shellcheck disable=SC2046
            [ "$step" -gt 1 ] && kill -9 $(tree "$step") 2>/dev/null || true
        done
        sleep 0.1
    done
}

case $command in
start)
    mkdir -p "$folder"/{state,spool1,spool2,munge}
    chmod 755 "$folder"
    export MUNGE_SOCKET=$folder/munge/socket
    dd if=/dev/urandom of="$folder/munge/key" bs=1024 count=1 status=none
    chmod 400 "$folder/munge/key"
    chmod 711 "$folder/munge"
    munged --foreground --force --key-file="$folder/munge/key" --socket="$MUNGE_SOCKET" \
        --pid-file="$folder/munge/pid" --log-file="$folder/munge/log" --seed-file="$folder/munge/seed" \
        >"$folder/munge/out" 2>&1 &
    echo $! >"$folder/munge.pid"
    host=$(hostname -s)
    ports=$(python3 - <<'PYTHON'
import socket
sockets = [socket.socket() for _ in range(3)]
for one in sockets:
    one.bind(("127.0.0.1", 0))
print(*(one.getsockname()[1] for one in sockets))
PYTHON
)
    read -r controller one two <<<"$ports"
    cat >"$conf" <<END
ClusterName=loopback
SlurmctldHost=$host(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket=$MUNGE_SOCKET,cred_expire=5
CredType=cred/munge
MpiDefault=none
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SlurmctldPort=$controller
SlurmctldPidFile=$folder/slurmctld.run
SlurmdPidFile=$folder/slurmd.%n.run
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool.%n
SlurmctldLogFile=$folder/slurmctld.log
SlurmdLogFile=$folder/slurmd.%n.log
ReturnToService=2
SlurmdTimeout=5
SlurmctldTimeout=10
InactiveLimit=0
KillWait=5
MinJobAge=300
SchedulerParameters=batch_sched_delay=0,sched_interval=1,sched_min_interval=0,default_queue_depth=1000
NodeName=node1 NodeHostname=$host NodeAddr=127.0.0.1 Port=$one CPUs=2 State=UNKNOWN
NodeName=node2 NodeHostname=$host NodeAddr=127.0.0.1 Port=$two CPUs=2 State=UNKNOWN
PartitionName=all Nodes=node1,node2 Default=YES MaxTime=INFINITE State=UP
END
    printf 'CgroupPlugin=autodetect\n' >"$folder/cgroup.conf"
    for _ in $(seq 50); do [ -S "$MUNGE_SOCKET" ] && break; sleep 0.1; done
    [ -S "$MUNGE_SOCKET" ] || fail "munged does not start: $(cat "$folder/munge/out" "$folder/munge/log")"
    setsid slurmctld -D -f "$conf" >"$folder/slurmctld.out" 2>&1 &
    echo $! >"$folder/slurmctld.pid"
    node 1
    node 2
    export SLURM_CONF=$conf
    for _ in $(seq 300); do
        [ "$(sinfo -h -N -t idle -o %N 2>/dev/null | wc -l)" = 2 ] && exit 0
        sleep 0.1
    done
    sinfo >&2 || true
    tail -n 20 "$folder"/*.out "$folder"/*.log >&2
    fail "the nodes are not idle after 30 s"
    ;;
kill)
    kill_node "$3"
    ;;
node) node "$3" ;;
stop)
    kill_node 1
    kill_node 2
    for pid in "$folder"/slurmctld.pid "$folder"/munge.pid; do
        [ -f "$pid" ] || continue
        # shellcheck disable=SC2046
        kill -9 $(tree "$(cat "$pid")") 2>/dev/null || true
    done
    ;;
*) fail "unknown command $command" ;;
esac
