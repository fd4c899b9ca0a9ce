"""What every room stands on: errors, ids, frames, units of time, arrays, whole files and markup."""
