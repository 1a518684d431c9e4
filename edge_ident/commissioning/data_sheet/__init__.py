"""From what data sheets say of an axis to a drive description."""
