"""What the networks answer on this processor, as JSON; the check asks two of them.

python -m tools.arm_check.answer IMAGES    an (n, 1, 100, 100) float32 array in a .npy file
"""

import json
import sys

import numpy as np

from edge_ident.estimation.manifest import VARIANTS
from edge_ident.estimation.network import load_network

if __name__ == "__main__":
    images = np.load(sys.argv[1], allow_pickle=False)
    print(json.dumps({v: load_network(v).residual_shares(images).tolist() for v in VARIANTS}))
