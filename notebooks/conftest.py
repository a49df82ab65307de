"""How ``pytest`` runs the notebooks: kernels inherit this environment."""

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")  # tiny inputs: threads cost more than they bring
