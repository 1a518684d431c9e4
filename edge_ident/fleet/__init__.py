"""Many recordings of many units, side by side: identified, diagnosed and compared."""
