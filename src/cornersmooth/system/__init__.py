"""What the operating system gives: processes, memory, whole files, LAPACK."""
