#!/bin/bash
# A campaign as an array job of PBS Pro or OpenPBS. NOT RUN by us: a template.
#
#   array=$(qsub pbs.sh)
#   qsub -W depend=afterany:$array -- /opt/softdock finish /scratch/dock
#PBS -N softdock
#PBS -J 0-15
#PBS -r y
#PBS -l select=1:ncpus=8
#PBS -l walltime=02:00:00
exec /opt/softdock worker /scratch/dock --part array/16 --backend cpu
