"""Programs that tests run under mpirun."""
