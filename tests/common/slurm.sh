#!/bin/sh
# A Slurm of two nodes on the loopback, for tests: no systemd, cgroups, database or root. State is in the folder $SLURM_STATE.
#
#   slurm.sh up            starts munged, slurmctld and two slurmd
#   slurm.sh down          cancels all jobs and ends the daemons
#   slurm.sh kill NODE     kills slurmd of a node with everything that it runs, as a power failure does
#   slurm.sh start NODE    starts it again
set -eu
state=${SLURM_STATE:?folder for the state}
PATH=/usr/sbin:/sbin:$PATH
base=${SLURM_PORTS:-27800}
export SLURM_CONF="$state/slurm.conf"

wait_until() { # tenths of a second, command
    left=$1
    shift
    until "$@" >/dev/null 2>&1; do
        left=$((left - 1))
        [ "$left" -gt 0 ] || {
            echo "slurm.sh: no success of: $*" >&2
            return 1
        }
        sleep 0.1
    done
}

# Kills a process with all its descendants, the ancestors stopped first so that none starts another.
kill_tree() {
    kill -STOP "$1" 2>/dev/null || true
    for child in $(pgrep -P "$1" || true); do kill_tree "$child"; done
    kill -KILL "$1" 2>/dev/null || true
}

start_node() {
    mkdir -p "$state/spool.$1" "$state/tmp.$1"
    slurmd -f "$SLURM_CONF" -N "$1" -L "$state/slurmd.$1.log"
}

both_idle() { [ "$(sinfo -h -N -t idle -o %N | wc -l)" -eq 2 ]; }
queue_is_empty() { [ -z "$(squeue -h -t running,completing,configuring)" ]; }
gone() { ! kill -0 "$1"; }

case "${1-}" in
up)
    mkdir -p "$state/controller" "$state/munge"
    chmod 755 "$state" "$state/munge"
    (umask 077 && head -c 128 /dev/urandom >"$state/munge/key")
    munged --key-file="$state/munge/key" --socket="$state/munge/socket" --pid-file="$state/munge/pid" \
        --log-file="$state/munge/log" --seed-file="$state/munge/seed" --num-threads=2
    wait_until 300 test -S "$state/munge/socket"
    user=$(id -un)
    host=$(hostname -s)
    # 121 s pass before a requeued job starts again with the default cred_expire; 5 s is the shortest that is accepted.
    cat >"$SLURM_CONF" <<CONF
ClusterName=asperity-test
SlurmctldHost=$host(127.0.0.1)
SlurmUser=$user
SlurmdUser=$user
AuthType=auth/munge
AuthInfo=socket=$state/munge/socket,cred_expire=5
CredType=cred/munge
SlurmctldPort=$base
SlurmdPort=$((base + 1))
CommunicationParameters=NoInAddrAny
StateSaveLocation=$state/controller
SlurmctldPidFile=$state/slurmctld.pid
SlurmctldLogFile=$state/slurmctld.log
SlurmdPidFile=$state/slurmd.%n.pid
SlurmdSpoolDir=$state/spool.%n
TmpFS=$state/tmp.%n
SlurmdParameters=config_overrides
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
MpiDefault=none
AccountingStorageType=accounting_storage/none
JobCompType=jobcomp/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerType=sched/backfill
SchedulerParameters=sched_interval=1,bf_interval=1,batch_sched_delay=0,requeue_delay=0
PriorityType=priority/basic
ReturnToService=2
SlurmdTimeout=5
SlurmctldTimeout=10
MessageTimeout=10
InactiveLimit=0
KillWait=5
MinJobAge=3600
MaxArraySize=1001
JobRequeue=1
NodeName=DEFAULT CPUs=4 Boards=1 SocketsPerBoard=1 CoresPerSocket=4 ThreadsPerCore=1 RealMemory=100000 State=UNKNOWN
NodeName=n1 NodeHostname=$host NodeAddr=127.0.0.1 Port=$((base + 2))
NodeName=n2 NodeHostname=$host NodeAddr=127.0.0.1 Port=$((base + 3))
PartitionName=test Nodes=ALL Default=YES MaxTime=INFINITE State=UP
CONF
    slurmctld -f "$SLURM_CONF"
    wait_until 900 scontrol ping # took more than 10 s on a busy machine
    start_node n1
    start_node n2
    wait_until 900 both_idle # took more than 20 s on a busy machine
    ;;
down)
    # Jobs first: a slurmd that ends while it starts one may hang.
    scancel --user="$(id -un)" 2>/dev/null || true
    wait_until 100 queue_is_empty || true
    for file in "$state"/slurmd.*.pid "$state/slurmctld.pid" "$state/munge/pid"; do
        [ -s "$file" ] || continue
        pid=$(cat "$file")
        kill "$pid" 2>/dev/null || true
        wait_until 50 gone "$pid" || kill_tree "$pid"
    done
    ;;
kill)
    pid=$(cat "$state/slurmd.$2.pid")
    kill -KILL "$pid"
    # The processes of jobs are children of slurmstepd, which has the log of its slurmd open.
    for step in $(pgrep -f '^slurmstepd: ' || true); do
        if ls -l "/proc/$step/fd" 2>/dev/null | grep -q "$state/slurmd.$2.log"; then kill_tree "$step"; fi
    done
    rm -f "$state/slurmd.$2.pid"
    ;;
start) start_node "$2" ;;
*)
    echo "usage: slurm.sh up | down | kill NODE | start NODE" >&2
    exit 2
    ;;
esac
